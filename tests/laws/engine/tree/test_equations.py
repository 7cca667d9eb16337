"""Slopes of the equations of motion of random trees against complex step: exact to rounding."""

import numpy as np
import pytest

from tests.sample_trees import random_tree
from workbench.engine.tree._kernels.forces import look_linearised, look_residual
from workbench.engine.tree._kernels.tables import SPHERICAL, tree_work
from workbench.engine.tree.compiled import tree_compiled, tree_on_grid

pytestmark = pytest.mark.slow

EXACT = 1e-13  # relative to the largest entry; a few units of rounding times the depth of the tree
TINY = 1e-30


class Complex:
    """The residual with every table and work array complex."""

    def __init__(self, parts, tables):
        self.tables = tables._replace(
            **{name: part.astype(complex) for name, part in tables._asdict().items() if part.dtype == float}
        )
        self.work = tree_work(tables, len(parts.states), complex)

    def residual(self, node, q, v, w):
        look_residual(self.tables, self.work, node, *(np.asarray(x, complex) for x in (q, v, w)))
        return self.work.force.copy()


def times_exponential(tables, q, move):
    """q exp(move), in numpy; move may be complex."""
    q = np.array(q, complex)
    for kind, _, first, count, at, _ in tables.link:
        if kind != SPHERICAL:
            q[at : at + count] += move[first : first + count]
            continue
        x = move[first : first + 3]
        t = np.sqrt(complex(x @ x))
        small = abs(t) < 1e-8
        w, by = (1.0, 0.5) if small else (np.cos(t / 2), np.sin(t / 2) / t)
        a, b = q[at : at + 4], by * x
        q[at : at + 4] = [a[0] * w - a[1:] @ b, *(a[0] * b + w * a[1:] + np.cross(a[1:], b))]
    return q


def by_steps(f, size):
    """Slopes of f(direction) by complex step along `size` axes, as columns."""
    return np.array([f(TINY * 1j * np.eye(size)[j]).imag / TINY for j in range(size)]).T


@pytest.mark.parametrize("seed", range(50))
def test_mass_stiffness_and_damping_are_the_slopes_of_the_residual(seed):
    rng = np.random.default_rng(seed)
    system = random_tree(rng, count=4 + seed % 6, first=seed % 7)
    parts = tree_compiled(system)
    tables = tree_on_grid(parts, rng.uniform(0.2, 1.0, 12), np.array([0.3]))
    work, smooth = tree_work(tables, len(parts.states)), Complex(parts, tables)
    n, full = len(tables.column), parts.size
    q, v, w = parts.start[0], rng.normal(size=full), rng.normal(size=full)
    v[n:] = 0.3
    look_linearised(tables, work, 0, q, v, w)

    def bare(by_q, by_v, by_w):
        return smooth.residual(0, times_exponential(tables, q, by_q), v + by_v, w + by_w)

    zero = np.zeros(full)
    value = bare(zero, zero, zero).real
    assert np.abs(work.force - value).max() < EXACT * np.abs(value).max()
    for found, slopes in (
        (work.m, by_steps(lambda e: bare(zero, zero, e), full)),
        (work.c, by_steps(lambda e: bare(zero, e, zero), full)),
        (work.k[:, :n], by_steps(lambda e: bare(e, zero, zero), full)[:, :n]),
    ):
        assert np.abs(found - slopes).max() < EXACT * np.abs(slopes).max()

"""Gradients in independent coordinates against complex step through the whole run: exact to rounding."""

import numpy as np
import pytest

from studies import three_body
from tests.laws.engine.test_complex_step import small_system
from tests.papers.engine.test_mechanisms import four_bars
from tests.unit.engine.natural.test_runs import sprung
from workbench.engine import (
    IndependentAlpha,
    Member,
    NaturalTrajectory,
    RungeKutta8,
    Scalar,
    Spring,
    System,
    Terminal,
    gradient,
    simulate,
)
from workbench.engine.integration.chart import chart
from workbench.engine.integration.dop853_tableau import A, B, C
from workbench.engine.integration.independent import march, march_rk8, point_times
from workbench.engine.natural import compiled as natural
from workbench.engine.natural import start as natural_start
from workbench.engine.natural import tables as natural_tables
from workbench.engine.planar._kernels.tables import work_space
from workbench.engine.planar.compiled import compiled, on_grid
from workbench.engine.planar.independent import independent_equations

pytestmark = pytest.mark.slow

EXACT = 1e-12
NEAR = 1e-7  # next to a dead point rounding is multiplied by a thousand on every level
TINY = 1e-30


def tied():
    """The four-bar linkage of two windows, two springs to the ground."""
    plain = four_bars(2)
    members = tuple(
        Member(a=bar, b="ground", point_a=(0.5, 0.0), point_b=(1.0, 2.0), law=Spring(k=3.0, c=0.2))
        for bar in ("bar0", "link1")
    )
    return System(bodies=plain.bodies, joints=plain.joints, members=members, gravity=plain.gravity)


def complex_equations(equations, parts, direction, work):
    """The same equations with every array complex, the densities bumped."""
    tables = equations.tables
    tables = tables._replace(
        **{name: part.astype(complex) for name, part in tables._asdict().items() if part.dtype == float}
    )
    tables = tables._replace(scale=tables.scale + TINY * 1j * direction[parts.order])
    x = equations.chart
    wide = chart(x.mass, x.weight, len(x.rows), full=len(x.full), states=len(x.states), dtype=complex)
    return equations._replace(tables=tables, work=work(tables, complex), chart=wide)


def by_complex_step(run, direction, slopes):
    """d(state at the end . slopes) along a direction of the densities."""
    r = run
    times = r.times if isinstance(r.scheme, IndependentAlpha) else point_times(r.times, C)
    if isinstance(r, NaturalTrajectory):
        parts, work = natural.compiled(r.system), natural_tables.work_space
        tables = natural.on_grid(parts, r.density, times)
        equations = natural_start.independent_equations(parts, tables)
    else:
        parts = compiled(r.system)
        equations, work = independent_equations(parts, on_grid(parts, r.density, times)), work_space
    equations = complex_equations(equations, parts, direction, work)
    q0, v0 = r.position[0].astype(complex), r.velocity[0].astype(complex)
    if isinstance(r.scheme, IndependentAlpha):
        found = march(equations, r.scheme, r.times, q0, v0)
    else:
        found, _, _ = march_rk8(equations, (A, B), r.times, q0, v0)
    np.testing.assert_array_equal(found.splits.cols, r.splits.cols)
    np.testing.assert_array_equal(found.splits.bridged, r.splits.bridged)
    by_q, by_v, by_w = slopes
    end = found.position[-1] @ by_q + found.velocity[-1] @ by_v + found.acceleration[-1] @ by_w
    return end.imag / TINY


CASES = {
    "joint": (three_body.problem().system, 0.2, 50),
    "slider, damper, belts, stops": (small_system(), 0.2, 50),
    "four bars past a dead point": (tied(), 0.8, 800),
    "bricard with springs": (sprung(), 0.5, 60),
}


@pytest.mark.parametrize("scheme", [IndependentAlpha(), IndependentAlpha(rho=0.7), RungeKutta8()], ids=repr)
@pytest.mark.parametrize("name", CASES)
def test_gradients_are_complex_step_through_the_run(name, scheme):
    system, t_end, steps = CASES[name]
    if isinstance(scheme, RungeKutta8):
        steps //= 10
        t_end *= 0.8  # before the dead point
    density = np.full(len(system.members), 0.3)
    run = simulate(system, density, t_end, steps, scheme=scheme)
    n = run.position.shape[1]
    rng = np.random.default_rng(3)
    slopes = (rng.normal(size=n), 0.1 * rng.normal(size=n), 1e-3 * rng.normal(size=n))

    def value(t, q, v, w, alpha):
        return q @ slopes[0] + v @ slopes[1] + w @ slopes[2]

    found = gradient(system, density, run, Terminal(quantity=Scalar(function=value)))
    direction = rng.normal(size=len(density))
    expected = by_complex_step(run, direction, slopes)
    error = abs(found @ direction - expected) / (np.linalg.norm(found) * np.linalg.norm(direction))
    print(f"{name}, {scheme}: {error:.1e}, bridged {run.splits.bridged.sum()}")
    assert abs(expected) > 0.0
    assert error < (NEAR if run.splits.tight.min() < 1e-2 else EXACT)

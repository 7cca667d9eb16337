"""Signs of elongations from their sizes."""

from itertools import product

import numpy as np
import pytest

from workbench.engine.layout.paths import elongations
from workbench.engine.layout.paths._kernels_signs import likeliest_signs
from workbench.engine.layout.paths.elongations import settled_signs


def path_of_elongations(seed, members=300, freedoms=30, designs=40):
    rng = np.random.default_rng(seed)
    fields = rng.standard_normal((freedoms, members))
    ways = rng.standard_normal((6, freedoms))
    rates = 0.6 * np.arange(1, 7)
    at = np.exp(-rates * np.linspace(0.0, 3.0, designs)[:, None]) @ ways + rng.standard_normal(freedoms)
    return at @ fields


def wrong(found, true):
    """Entries whose sign does not relate to that at the last design as the true one does."""
    agree = np.sign(found) * np.sign(true)
    return int((agree * agree[-1] < 0).sum())


def settled_on_the_way(true):
    """Signs as a path finds them: of each new design those of the one before, then what agrees."""
    table = np.abs(true[:1])
    for entry in np.abs(true[1:]):
        table = settled_signs(np.vstack([table, np.copysign(entry, table[-1])]))
    return table


@pytest.mark.parametrize("seed", range(4))
def test_elongations_that_pass_zero_are_found(seed):
    true = path_of_elongations(seed)
    assert wrong(np.abs(true), true) > 500
    assert wrong(settled_on_the_way(true), true) < len(true)  # of a single member at most


def test_the_best_signs_are_those_of_all():
    rng = np.random.default_rng(4)
    L = np.linalg.cholesky(
        np.cov(
            rng.standard_normal((6, 4)) @ rng.standard_normal((4, 30)) + 0.01 * rng.standard_normal((6, 30))
        )
    )
    size = np.abs(rng.standard_normal((5, 6)))
    ways = np.array([(1.0, *way) for way in product((1.0, -1.0), repeat=5)])
    signs, misfits = likeliest_signs(size, L, 64)
    for column, found, least in zip(size, signs, misfits, strict=True):
        all_misfits = (np.linalg.solve(L, (ways * column).T) ** 2).sum(axis=0)
        np.testing.assert_array_equal(found, ways[all_misfits.argmin()])
        np.testing.assert_allclose(least, np.sort(all_misfits)[:2])


def test_true_signs_stay_related_and_sizes_always_do():
    true = path_of_elongations(9)
    assert wrong(settled_signs(true), true) == 0
    rng = np.random.default_rng(10)
    mixed = true * rng.choice([-1.0, 1.0], size=true.shape)
    np.testing.assert_allclose(np.abs(settled_signs(mixed)), np.abs(true), rtol=1e-12)


def test_two_designs_tell_nothing_and_silent_ones_do_no_harm():
    two = path_of_elongations(3, designs=2)
    np.testing.assert_array_equal(settled_signs(two), two)
    silent = path_of_elongations(3)
    silent[5] = 0.0
    assert np.isfinite(settled_signs(silent)).all()


def test_of_many_members_fewer_designs_are_looked_at(monkeypatch):
    true = path_of_elongations(5)
    monkeypatch.setattr(elongations, "_ENTRIES", 5 * true.shape[1])
    turned = true.copy()
    turned[20] *= -1
    found = settled_signs(turned)
    assert wrong(found[-5:], true[-5:]) == 0
    assert (found[20] * found[30] * true[20] * true[30] <= 0).all()

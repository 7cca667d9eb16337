"""Signs of elongations from their sizes."""

import numpy as np
import pytest

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


@pytest.mark.parametrize("seed", range(4))
def test_elongations_that_pass_zero_are_found(seed):
    true = path_of_elongations(seed)
    assert wrong(np.abs(true), true) > 500
    assert wrong(settled_signs(np.abs(true)), true) < len(true)  # of a single member at most


def test_true_signs_stay_and_sizes_always_do():
    true = path_of_elongations(9)
    np.testing.assert_allclose(settled_signs(true), true, rtol=1e-12)
    rng = np.random.default_rng(10)
    mixed = true * rng.choice([-1.0, 1.0], size=true.shape)
    np.testing.assert_allclose(np.abs(settled_signs(mixed)), np.abs(true), rtol=1e-12)


def test_two_designs_tell_nothing_and_silent_ones_do_no_harm():
    two = path_of_elongations(3, designs=2)
    np.testing.assert_array_equal(settled_signs(two), two)
    silent = path_of_elongations(3)
    silent[5] = 0.0
    assert np.isfinite(settled_signs(silent)).all()

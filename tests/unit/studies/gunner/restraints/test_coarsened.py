"""Runs at a longer step rank the cases of the gunner as the true ones do."""

import numpy as np
import pytest

from studies.gunner.restraints.model import restraint


@pytest.mark.parametrize("on", ["braking", pytest.param("rollover", marks=pytest.mark.slow)])
def test_the_deviation_at_four_times_the_step_is_near_the_true_one(on):
    model = restraint(on=on, t_end=0.6)
    density = np.full(model.members, 12.0 / model.members)
    cases = [{"mass": mass, "hands": hands} for mass in (60.0, 95.0) for hands in ("one", "none")]
    coarse = np.array([one["deviation"] for one in model.coarsened(density, cases, threads=1)])
    fine = np.array([model.responses(density, case)["deviation"] for case in cases])
    assert np.abs(coarse / fine - 1).max() < 0.02
    assert not np.array_equal(coarse, fine)
    assert list(np.argsort(coarse)) == list(np.argsort(fine))

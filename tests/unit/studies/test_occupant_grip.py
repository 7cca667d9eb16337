"""The grip profile: the search against the truth on all 51 grid points, and profiles that say nothing."""

import numpy as np
import pytest

from studies.occupant_braking import LEFT
from studies.occupant_grip import CASE, profile, search


@pytest.mark.slow
def test_one_hand_holds_from_a_grip_inside_the_range_on():
    truth = profile()
    assert len(truth.grip) == 51
    assert not truth.is_flat
    assert 350.0 < truth.threshold < 700.0
    held = truth.deviation < LEFT
    assert (np.diff(held.astype(int)) >= 0).all()  # who is held stays held with more grip
    found = search(budget=15)
    assert found.evaluations <= 15
    assert found.value == pytest.approx(truth.deviation.max(), rel=1e-3)


def test_without_hands_or_in_mild_braking_with_both_the_profile_is_said_to_be_flat():
    for case in ({"hands": "none"}, {"hands": "both", "deceleration": 7.0, "mass": 77.0}):
        truth = profile({**CASE, **case})
        assert truth.is_flat
        assert truth.threshold is None


def test_in_hard_braking_both_hands_need_some_grip_too():
    """He folds his arms up to their stops, and the stops push weak hands off."""
    truth = profile({**CASE, "hands": "both", "deceleration": 9.0})
    assert not truth.is_flat
    assert 350.0 < truth.threshold < 420.0

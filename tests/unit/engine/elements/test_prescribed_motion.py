"""Prescribed motions sampled at once are those sampled one by one, to the bit."""

import numpy as np
import pytest

from studies.occupant import braking
from workbench.engine import Motion

TIMES = np.linspace(0.0, 4.0, 401)


@pytest.mark.parametrize(
    "motion",
    [
        braking(7.3),
        Motion(position=lambda t: (np.sin(t), t**3, 0.5 * t)),
        Motion(position=lambda t: np.array([t, 0.0, 0.0]), velocity=lambda t: np.array([1.0, 0.0, 0.0])),
    ],
    ids=["pulse", "velocity by differences", "arrays"],
)
def test_samples_are_places_and_speeds(motion):
    one_by_one = np.array([[motion.place(t), motion.speed(t)] for t in TIMES])
    np.testing.assert_array_equal(motion.sampled(TIMES), one_by_one)


def test_the_pulse_rests_before_the_brakes_and_in_the_end():
    motion = braking(8.0)
    np.testing.assert_array_equal(motion.push(0.5), [0.0, 0.0, 0.0])
    assert motion.push(1.0)[0] == 8.0
    np.testing.assert_allclose(motion.speed(4.0), 0.0, atol=1e-12)


def test_a_motion_is_asked_once_for_each_grid():
    """Many cases of one motion share its samples; the motions of two cases never do."""
    asked = []

    def place(t):
        asked.append(t)
        return (t, 0.0, 0.0)

    motion = Motion(position=place, velocity=lambda t: (1.0, 0.0, 0.0))
    first = motion.sampled(TIMES)
    assert motion.sampled(TIMES.copy()) is first
    assert len(asked) == len(TIMES)
    np.testing.assert_array_equal(motion.sampled(TIMES[:7]), first[:7])
    for count in range(10, 20):  # more grids than are kept
        assert len(motion.sampled(TIMES[:count])) == count
    np.testing.assert_array_equal(motion.sampled(TIMES), first)
    other = Motion(position=lambda t: (2.0 * t, 0.0, 0.0), velocity=lambda t: (2.0, 0.0, 0.0))
    np.testing.assert_array_equal(other.sampled(TIMES)[:, 0], 2.0 * first[:, 0])


def test_what_is_shared_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        braking(7.0).sampled(TIMES)[0] = 1.0

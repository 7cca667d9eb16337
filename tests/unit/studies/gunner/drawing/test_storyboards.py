"""Stills of the manoeuvres: all of them named, the vehicle in the middle of each."""

import numpy as np
import pytest

from studies.gunner.drawing.storyboards import MIDDLE, TIMES, camera_beside, figure, ridden
from studies.gunner.proving_grounds import rough


def test_every_proving_ground_is_shown():
    names = {ground.name for ground, _ in TIMES.values()}
    assert names == {"straight", "braking", "step steer", "rollover", "rough", "kerb trip"}


@pytest.mark.slow
def test_a_row_has_a_still_for_every_time_and_says_how_far_he_is():
    made = figure({"waves": (rough(), (0.0, 0.02))})
    axes = made.get_axes()
    assert [ax.get_title(loc="left") for ax in axes] == ["waves\n0 s, 0.00 m", "0.02 s, 0.00 m"]
    for ax in axes:
        image = np.asarray(ax.get_images()[0].get_array())
        assert image[..., :3].std() > 5.0  # something is seen


def test_the_camera_goes_along():
    _, motion = ridden(rough(), 0.1)
    start, end = (camera_beside(motion, time) for time in (0.0, 0.1))
    hull = [body.name for body in motion.runs[0].bodies].index("hull")
    driven = motion.runs[0].poses[-1, hull, :3] - motion.runs[0].poses[0, hull, :3]
    assert driven[0] > 1.5
    assert np.abs(end.target - start.target - driven).max() < 0.01 * np.abs(MIDDLE).max()

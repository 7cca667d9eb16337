"""What pictures of a motion hold."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_motion import sample_film, sample_motion
from workbench.errors import StudyError
from workbench.motion.frames import side_by_side
from workbench.motion.framing import APART, MARGIN, camera_on_occupant, subject
from workbench.motion.stills import CAMERAS, project

SEGMENTS = 6  # bodies of the occupant


@pytest.mark.parametrize("preset", sorted(CAMERAS))
def test_the_occupant_is_in_the_picture_in_every_frame(preset):
    film = sample_film()
    for run, shown in enumerate(film.runs):
        for frame in range(0, len(film.times), 15):
            camera = camera_on_occupant(film, frame, run=run, preset=preset)
            at = project(camera, shown.poses[frame, :SEGMENTS, :3], width=480, height=300)
            assert ((at > 0) & (at < [480, 300])).all()


def test_what_is_framed_drives_and_turns_with_the_vehicle():
    film = sample_film()
    held = film.runs[2]  # he moves little beside the cab, which drives 9 m and rolls by 60 deg
    first, last = subject(held, 0), subject(held, 75)
    assert np.linalg.norm(last[0] - first[0]) > 8.0
    assert last[1] < 1.5
    thrown = subject(film.runs[0], 75)
    assert thrown[1] > 6.0  # as far as he flies


def test_runs_of_a_case_are_seen_at_one_scale():
    film = sample_film()
    before, after = (camera_on_occupant(film, 75, run=k) for k in (2, 3))
    reach = [float(np.linalg.norm(camera.eye - camera.target)) for camera in (before, after)]
    assert reach[0] == pytest.approx(reach[1])


def test_who_is_thrown_out_does_not_make_the_others_small():
    motion = sample_motion()
    poses = motion.runs[0].poses.copy()
    poses[75, :SEGMENTS, 0] += 30.0
    motion = replace(motion, runs=(replace(motion.runs[0], poses=poses), motion.runs[1]))
    for run, radius in ((0, subject(motion.runs[0], 75)[1]), (1, APART * subject(motion.runs[1], 75)[1])):
        camera = camera_on_occupant(motion, 75, run=run)
        reach = float(np.linalg.norm(camera.eye - camera.target)) * np.sin(camera.half_angle)
        assert reach == pytest.approx(MARGIN * radius)


def test_without_an_occupant_the_whole_motion_is_seen():
    motion = sample_motion()
    bare = replace(motion, runs=tuple(
        replace(run, bodies=tuple(replace(b, role="other") for b in run.bodies)) for run in motion.runs
    ))  # fmt: skip
    assert subject(bare.runs[0], 0) is None
    points = bare.runs[0].poses[:, :, :3].reshape(-1, 3)
    at = project(camera_on_occupant(bare, 0), points, width=480, height=300)
    assert ((at > 0) & (at < [480, 300])).all()


def test_cases_need_the_same_times():
    motion = sample_motion()
    late = replace(motion, times=motion.times + 0.1)
    with pytest.raises(StudyError, match="the motion of case 'late' has other times than that of the first"):
        side_by_side({"early": motion, "late": late})
    both = side_by_side({"a": motion, "b": motion})
    assert [run.case for run in both.runs] == ["a", "a", "b", "b"]
    assert [history.case for history in both.histories] == ["a", "a", "b", "b"]

"""How large the page of a robust loop is with the motion that was agreed on: three runs, 300 frames."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_campaign import write_loop, write_sample
from tests.sample_motion import sample_film
from workbench.motion.frames import Motion
from workbench.report.writing import write_report
from workbench.system.atomic import write_json

RUNS, FRAMES, BODIES, MEMBERS = 3, 300, 40, 180
ALLOWED = 2_500_000  # bytes


def agreed_motion() -> Motion:
    """The sample's film with as many frames, bodies and members, with the force of each, in three runs."""
    film = sample_film()
    held = next(run for run in film.runs if run.members)
    before, times = np.linspace(0.0, 1.0, len(film.times)), np.linspace(0.0, 1.0, FRAMES)
    rng = np.random.default_rng(7)

    def stretched(values):
        flat = np.asarray(values).reshape(len(before), -1)
        return np.stack([np.interp(times, before, column) for column in flat.T], axis=1)

    poses = stretched(held.poses).reshape(FRAMES, -1, 7)
    more = rng.integers(len(held.bodies), size=BODIES - len(held.bodies))
    forces = np.maximum(rng.normal(200.0, 300.0, (FRAMES, MEMBERS)), 0.0)
    names = [f"run {k}" for k in range(RUNS)]
    run = replace(
        held, case="", forces=forces, poses=np.concatenate([poses, poses[:, more]], axis=1),
        bodies=(
            *held.bodies, *(replace(held.bodies[k], name=f"further {i}") for i, k in enumerate(more))
        ),
        members=tuple(
            replace(held.members[k % len(held.members)], name=f"member {k}") for k in range(MEMBERS)
        ),
    )  # fmt: skip
    histories = [
        replace(history, case="", series={name: stretched(values)[:, 0] for name in names})
        for history in film.histories[:2] for values in [next(iter(history.series.values()))]
    ]  # fmt: skip
    return Motion(
        title=film.title, times=times * film.times[-1], runs=tuple(replace(run, label=n) for n in names),
        histories=tuple(histories), storyboard=film.storyboard,
    )  # fmt: skip


@pytest.mark.slow
def test_three_runs_of_300_frames_with_180_members_fit(tmp_path):
    folder = write_sample(tmp_path / "sample.holdfast")
    write_loop(folder)
    motion = agreed_motion()
    write_json(folder / "motion.json", motion.to_dict())
    (seen,) = {(len(r.bodies), len(r.members), *r.forces.shape) for r in motion.runs}
    assert (len(motion.runs), *seen) == (RUNS, BODIES, MEMBERS, FRAMES, MEMBERS)
    size = write_report(folder).stat().st_size
    print(f"{size / 1e6:.3f} MB, of it motion {(folder / 'motion.json').stat().st_size / 1e6:.3f} MB")
    assert size < ALLOWED

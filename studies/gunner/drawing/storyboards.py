"""Every manoeuvre as stills: vehicle, ground and gunner, both hands on, at four times.

    python -m studies.gunner.drawing.storyboards [folder]

writes `gunner_manoeuvres.png` into the folder. Each row is a proving ground, with the largest deviation of
the gunner's mass centre up to each time.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from workbench.engine import TreeTrajectory, simulate
from workbench.motion.frames import Motion, rotate
from workbench.motion.stills import Camera, still

from ..cases import Case, system
from ..proving_grounds import ProvingGround, braking, kerb_trip, rollover, rough, step_steer, straight
from ..uncertain import STEP
from .bodies import motion_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["TIMES", "camera_beside", "figure", "main", "ridden"]

TIMES: Mapping[str, tuple[ProvingGround, tuple[float, ...]]] = {
    "straight": (straight(), (0.0, 0.5, 1.0, 1.5)),
    "severe braking": (braking(), (0.0, 0.8, 1.1, 1.5)),
    "step steer": (step_steer(), (0.0, 0.5, 1.0, 1.5)),
    "rollover": (rollover(), (0.0, 2.0, 2.4, 2.7)),
    "rough terrain, waves of 0.10 m": (rough(amplitude=0.10), (0.0, 1.0, 2.0, 3.0)),
    "kerb trip": (kerb_trip(), (0.0, 0.3, 0.6, 0.9)),
}
SIZE = (420, 300)  # pixels of a still
MIDDLE = np.array([-1.7, 0.0, 1.1])  # m, of vehicle and gunner in the vehicle's frame
AWAY = np.array([4.0, -9.0, 3.2])  # m, from the vehicle to the eye
HALF_ANGLE = 0.24  # rad


def ridden(ground: ProvingGround, t_end: float) -> tuple[TreeTrajectory, Motion]:
    """A run of the gunner on a ground, both hands on, and its motion."""
    case = Case(on=ground)
    run = simulate(system(case), np.zeros(0), t_end, round(t_end / STEP))
    return run, motion_of({"both hands": run}, case, title=ground.name)


def camera_beside(motion: Motion, time: float) -> Camera:
    """From the front, the right and above, at the place where the vehicle is."""
    frame = int(np.abs(motion.times - time).argmin())
    run = motion.runs[0]
    hull = next(k for k, body in enumerate(run.bodies) if body.name == "hull")
    pose = run.poses[frame, hull]
    target = pose[:3] + rotate(pose[3:], MIDDLE)
    return Camera(eye=target + AWAY, target=target, half_angle=HALF_ANGLE)


def figure(times: Mapping[str, tuple[ProvingGround, tuple[float, ...]]] = TIMES) -> "Figure":
    """Manoeuvres by times."""
    from matplotlib.figure import Figure

    columns = max(len(at) for _, at in times.values())
    made = Figure(figsize=(2.6 * columns, 2.05 * len(times)), layout="constrained")
    for row, (name, (ground, at)) in enumerate(times.items()):
        _, motion = ridden(ground, at[-1])
        reach = next(iter(motion.histories[0].series.values()))
        for column, time in enumerate(at):
            ax = made.add_subplot(len(times), columns, row * columns + column + 1)
            ax.imshow(still(
                motion, time=time, camera=camera_beside(motion, time), width=SIZE[0], height=SIZE[1]
            ))  # fmt: skip
            ax.set_axis_off()
            so_far = float(np.max(reach[motion.times <= time + 1e-9]))
            start = f"{name}\n" if column == 0 else ""
            ax.set_title(f"{start}{time:g} s, {so_far:.2f} m", fontsize=8, loc="left")
    return made


def main() -> None:
    """Write the figure."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    figure().savefig(folder / "gunner_manoeuvres.png", dpi=110)


if __name__ == "__main__":
    main()

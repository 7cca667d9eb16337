"""Figures 8.5 to 8.13 of the dissertation with our gunner: the same quantities over the same manoeuvres.

    python -m studies.gunner.drawing.source_figures [folder]

writes `gunner_source_figures.png` into the folder and prints what is read off the curves. Grips hold 350 N,
as in section 8.2.2. The source's figures are pictures without tables, so its curves cannot be drawn beside
ours: what its text says of them is compared in docs/explanation/the-gunner.md.
"""

import sys
from collections.abc import Sequence
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.engine import RelativeSpeed, TreeTrajectory, simulate

from ..cases import Case, system
from ..figure import FIGURE
from ..occupant_responses import RING_HEIGHT, responses_of, shares_of
from ..proving_grounds import braking, rollover, rough
from ..uncertain import STEP

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["AMPLITUDES", "figure", "main", "mass_centre", "relative_head_speed", "ridden", "told"]

Array = np.ndarray[Any, Any]

GRIP = 350.0  # N, section 8.2.2
AMPLITUDES = (0.03, 0.04, 0.05)  # m, figure 8.11
SEEN = (-2.0, 0.5)  # m over the ring
AMONG_CONTACTS = 2  # steps at L1 for one at L0


def ridden(case: Case, t_end: float) -> TreeTrajectory:
    """A run of `t_end` seconds with the usual step of its level."""
    steps = round(t_end / STEP) * (AMONG_CONTACTS if case.level == "L1" else 1)
    return simulate(system(case), np.zeros(0), t_end, steps)


def mass_centre(run: TreeTrajectory) -> Array:
    """(steps + 1, 3) place of the gunner's mass centre in the vehicle's frame, m."""
    return run.view(bodies=FIGURE, reference="vehicle", shares=shares_of(run.system)).series()


def relative_head_speed(run: TreeTrajectory) -> Array:
    """(steps + 1,) speed of the head seen from the gunpoint, which moves with the vehicle, m/s."""
    centre = next(body.centre for body in run.system.bodies if body.name == "head")
    return np.asarray(RelativeSpeed(body="head", point=centre, reference="vehicle").values(run))


def braked(t_end: float) -> dict[str, TreeTrajectory]:
    """Severe braking with hands on and free, at both levels."""
    return {
        f"{hands}, {level}": ridden(Case(on=braking(), grip=GRIP, hands=held, level=level), t_end)
        for level in ("L0", "L1")
        for hands, held in (("hands on", "both"), ("hands free", "none"))
    }


def figure(*, t_end: float = 3.0, amplitudes: Sequence[float] = AMPLITUDES) -> tuple["Figure", list[str]]:
    """The panels, and the lines that `told` makes of their runs."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(10, 8.4), layout="constrained")
    axes = made.subplots(3, 2).ravel()
    brakes = braked(t_end)
    rolled = ridden(Case(on=rollover(), grip=GRIP), t_end)
    waves = {a: ridden(Case(on=rough(amplitude=a), grip=GRIP), t_end) for a in amplitudes}
    _draw_braking(axes[0], axes[1], brakes)
    _draw_rollover(axes[2], axes[3], rolled)
    _draw_waves(axes[4], axes[5], waves)
    for ax in axes:
        ax.grid(alpha=0.3)
    lines = [told(f"braking, {name}", run) for name, run in brakes.items()]
    lines += [told("rollover, hands on, L0", rolled)]
    lines += [told(f"waves of {a:g} m, hands on, L0", run) for a, run in waves.items()]
    return made, lines


def told(name: str, run: TreeTrajectory) -> str:
    """What a run says, on a line; the head's rms is that from 1 s on, where the run lasts longer."""
    found = responses_of(run)
    out = f"over the ring and out at {found['ejected_at']:.2f} s" if found["ejected"] else "not over the ring"
    return (
        f"{name}: rise {1e3 * found['rise']:.0f} mm at {found['rise_at']:.2f} s, "
        f"g2 {found['min_g2']:.2f} to {found['g2']:.2f} m, {out}, "
        f"head {found['head_speed_rms']:.2f} m/s rms"
    )


def _draw_braking(speed: "Axes", height: "Axes", runs: dict[str, TreeTrajectory]) -> None:
    first = next(iter(runs.values()))
    speed.plot(first.times, first.frames("vehicle").velocity[:, 0])
    _named(speed, "8.5: severe braking", "speed of the vehicle, m/s")
    for name, run in runs.items():
        dashes = "--" if name.endswith("L1") else "-"
        colour = "C0" if name.startswith("hands on") else "C3"
        height.plot(run.times, mass_centre(run)[:, 2] - RING_HEIGHT, dashes, color=colour, label=name)
    height.axhline(0.0, color="0.5", lw=0.8)
    height.set_ylim(*SEEN)  # at L0 nothing ends a fall
    height.legend(fontsize=8)
    _named(height, "8.6, 8.12, 8.13: severe braking", "height of the mass centre over the ring, m")


def _draw_rollover(steering: "Axes", place: "Axes", run: TreeTrajectory) -> None:
    driver = rollover().manoeuvre.steering
    steering.plot(run.times, [degrees(driver(t)) for t in run.times])
    _named(steering, "8.7: rollover", "steering wheel, deg")
    centre = mass_centre(run)
    place.plot(run.times, centre[:, 1] - centre[0, 1], label="to the left")
    place.plot(run.times, centre[:, 2] - centre[0, 2], label="up")
    place.legend(fontsize=8)
    _named(place, "8.8: rollover, hands on", "mass centre in the vehicle, from its start, m")


def _draw_waves(road: "Axes", speed: "Axes", runs: dict[float, TreeTrajectory]) -> None:
    x = np.linspace(0.0, 40.0, 400)
    for amplitude, run in runs.items():
        ground = rough(amplitude=amplitude).ground.road
        road.plot(x, [ground.height(float(at), 0.0) for at in x], label=f"{amplitude:g} m")
        speed.plot(run.times, relative_head_speed(run), label=f"{amplitude:g} m")
    for ax in (road, speed):
        ax.legend(fontsize=8)
    road.set_xlabel("x, m", fontsize=8)
    _named(road, "8.9: rough terrain", "height of the road, m", over_time=False)
    _named(speed, "8.11: rough terrain", "head seen from the gunpoint, m/s")


def _named(ax: "Axes", title: str, quantity: str, *, over_time: bool = True) -> None:
    ax.set_title(title, fontsize=9, loc="left")
    ax.set_ylabel(quantity, fontsize=8)
    ax.tick_params(labelsize=8)
    if over_time:
        ax.set_xlabel("time, s", fontsize=8)


def main() -> None:
    """Write the figure and print its lines."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    made, lines = figure()
    made.savefig(folder / "gunner_source_figures.png", dpi=110)
    print("\n".join(lines))


if __name__ == "__main__":
    main()

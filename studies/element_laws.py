"""What each element of a spatial system does, read off runs on a test rig.

A body is driven along a path, and elements push on it: contacts, bushings, a tyre on a road. What is drawn is
what a run reports (`contact_forces`, `bushing_force`, `tyre_forces`), not a formula written a second time;
stops of joints are the torques that `equilibrium` finds for held angles. The laws of restraints stand in
`studies.restraint_laws`.

    python -m studies.element_laws [folder]      writes the figure
"""

import sys
from collections.abc import Callable, Mapping
from math import cos, pi, sin, tan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from studies.gunner.parameters import read
from studies.gunner.vehicle.numbers import Tyres
from workbench.engine import (
    CoordinateSpring,
    Plane,
    Prescribed,
    Prismatic,
    Retractor,
    Revolute,
    SpatialBody,
    SpatialBushing,
    SpatialContact,
    SpatialMotion,
    Spring,
    Timed,
    TreeSystem,
    Tyre,
    equilibrium,
    simulate,
)
from workbench.engine.elements.law_series import law_series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["LOADS", "figures", "hmmwv_tyre", "run", "tyre_on_a_rig"]

Array = NDArray[np.float64]
# a run needs something that may move: a body of its own, far from the rig
IDLE = SpatialBody(name="idle", joint=Prismatic(axis=(0.0, 0.0, 1.0)), mass=1.0, inertia=(1.0, 1.0, 1.0))
STEPS = 800
NORMAL = {"k": 1e6, "power": 1.5, "width": 1e-3}  # N/m^1.5, of the contacts
DAMPINGS = (0.0, 0.5, 2.0)  # s/m
LOADS = (4000.0, 7000.0, 10000.0)  # N, on the tyre
SLIPS = 0.35  # largest, longitudinal and tangent of the angle
GRIP = 371.0  # N, table 8.5: the strongest grip of a hand
WIDTHS = (0.01, 0.05, 0.15)  # rad, of a joint's stops


def run(seed: int = 0) -> dict[str, xr.Dataset]:
    """What each element gives on its rig: a dataset per drawing.

    seed: nothing is drawn; it is taken so that all studies are called alike.
    """
    return {
        "contact": _contact(),
        "friction": _friction(),
        "bushing": _bushing(),
        "breakage": _breakage(),
        "stops": _stops(),
        "lateral": _pure_slip(lateral=True),
        "longitudinal": _pure_slip(lateral=False),
        "combined": _combined_slip(),
        "relaxation": _relaxation(),
        "pulses": _pulses(),
    }


def _driven(path: Callable[[float], tuple[float, float, float]], t_end: float, **elements: Any) -> Any:
    """A run of a body "probe" along a path t -> (x, y, z), m, with elements between it and the ground."""
    probe = SpatialBody(name="probe", joint=Prescribed(motion=SpatialMotion(position=path)))
    system = TreeSystem(bodies=(probe, IDLE), gravity=(0.0, 0.0, 0.0), **elements)
    return simulate(system, np.ones(0), t_end, STEPS)


def _dataset(**series: tuple[Array, str]) -> xr.Dataset:
    """Series of the same length, with their units."""
    return xr.Dataset({name: ("point", values, {"units": unit}) for name, (values, unit) in series.items()})


def _contact() -> xr.Dataset:
    """A ball of 50 mm pressed 10 mm into a plane and drawn out, within 0.2 s, by damping."""
    radius, found = 0.05, {}
    for damping in DAMPINGS:
        contact = SpatialContact(a="probe", shape=Plane(), radius=radius, damping=damping, **NORMAL)
        one = _driven(
            lambda t: (0.0, 0.0, radius - 0.01 * sin(5 * pi * t)), 0.2, contacts=(contact,)
        )  # fmt: skip
        found[f"{damping:g} s/m"] = one.contact_forces().force[:, 0, 2]
    depth = 0.01 * np.sin(5 * pi * one.times)
    return _dataset(depth=(depth, "m"), **{name: (force, "N") for name, force in found.items()})


def _friction() -> xr.Dataset:
    """A ball that is pressed in by 5 mm and slides back and forth with up to 0.4 m/s."""
    contact = SpatialContact(a="probe", shape=Plane(), radius=0.05, friction=0.7, slow=0.05, **NORMAL)
    one = _driven(lambda t: (0.2 * t * t - 0.4 * t, 0.0, 0.045), 2.0, contacts=(contact,))
    force = one.contact_forces().force[:, 0]
    return _dataset(speed=(0.4 * one.times - 0.4, "m/s"), share=(force[:, 0] / force[:, 2], "1"))


def _bushing() -> xr.Dataset:
    """A bushing pulled slowly out and back by 60 mm either way: linear, capped, and capped on one side."""
    kinds: Mapping[str, dict[str, Any]] = {
        "linear": {},
        "capped": {"cap": GRIP},
        "capped where it opens": {"cap": GRIP, "opens": (1.0, 0.0, 0.0), "push_cap": 4 * GRIP},
    }
    found = {}
    for name, kind in kinds.items():
        bushing = SpatialBushing(a="probe", k=2e4, name="grip", **kind)
        one = _driven(lambda t: (0.06 * sin(2 * pi * t), 0.0, 0.0), 1.0, bushings=(bushing,))
        found[name] = -one.bushing_force("grip")[:, 0]
    apart = 0.06 * np.sin(2 * pi * one.times)
    return _dataset(apart=(apart, "m"), **{name: (force, "N") for name, force in found.items()})


def _breakage() -> xr.Dataset:
    """A grip that slips from 40 mm and lets go at 80 mm, pulled to 100 mm and brought back."""
    bushing = SpatialBushing(a="probe", k=2e4, cap=GRIP, slip=0.04, release=0.08, tau=0.02, name="grip")
    one = _driven(lambda t: (0.1 * sin(pi * t), 0.0, 0.0), 1.0, bushings=(bushing,))
    return _dataset(
        time=(one.times, "s"), apart=(0.1 * np.sin(pi * one.times), "m"),
        force=(-one.bushing_force("grip")[:, 0], "N"), damage=(one.states[:, 0], "1"),
    )  # fmt: skip


def _stops() -> xr.Dataset:
    """Torque that holds an elbow of 0 to 142 deg at an angle, with stops of three widths."""
    angles, found = np.radians(np.linspace(-15.0, 157.0, 87)), {}
    for width in WIDTHS:
        held = []
        for angle in angles:
            arm = SpatialBody(
                name="arm", joint=Revolute(angle=float(angle)), mass=1.0, inertia=(0.1, 0.1, 0.1)
            )
            spring = CoordinateSpring(
                body="arm", k=20.0, rest=0.0, k_stop=1000.0, lower=0.0, upper=np.radians(142.0), width=width
            )
            system = TreeSystem(bodies=(arm, IDLE), springs=(spring,), gravity=(0.0, 0.0, 0.0))
            found_at = equilibrium(system, np.ones(0), held=(("arm", 0),))
            held.append(found_at.torques["arm", 0])
        found[f"{width:g} rad"] = np.array(held)
    return _dataset(
        angle=(np.degrees(angles), "deg"), **{name: (torque, "N m") for name, torque in found.items()}
    )


def hmmwv_tyre(**changed: Any) -> Tyre:
    """The tyre of the gunner's vehicle, on a wheel "wheel"."""
    numbers = read(Tyres, "vehicle.tyre")
    settings: dict[str, Any] = {
        "radius": numbers.radius, "stiffness": numbers.stiffness, "damping": 0.0, "nominal_load": 7000.0,
        "lateral": numbers.lateral, "longitudinal": numbers.longitudinal, "friction": 0.8,
        "reference_friction": numbers.reference_friction, "relaxation": numbers.relaxation,
    }  # fmt: skip
    return Tyre(body="wheel", **settings | changed)


def tyre_on_a_rig(
    load: float,
    slip: Callable[[float], tuple[float, float]],
    *,
    t_end: float = 8.0,
    speed: float = 20.0,
    relaxation: float = 0.1,
) -> tuple[Array, Array]:
    """Times, and force (steps + 1, 3) of the road along, across and upwards, in the wheel's own directions.

    slip: t -> longitudinal slip and tangent of the slip angle at the rig.    load: N.    speed: m/s.
    """
    tyre = hmmwv_tyre(relaxation=relaxation)
    height = tyre.radius - load / tyre.stiffness

    def heading(t: float) -> float:
        return float(np.arctan(slip(t)[1]))

    def spun(t: float) -> tuple[float, float, float]:
        rate = speed * cos(heading(t)) * (1.0 + slip(t)[0]) / height
        return -sin(heading(t)) * rate, cos(heading(t)) * rate, 0.0

    def turned(t: float) -> Array:
        # the wheel's own turn about its axle changes nothing that a tyre sees
        c, s = cos(heading(t)), sin(heading(t))
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    motion = SpatialMotion(
        position=lambda t: (speed * t, 0.0, height), velocity=lambda t: (speed, 0.0, 0.0),
        acceleration=lambda t: (0.0, 0.0, 0.0), rotation=turned, spin=spun,
        spin_rate=lambda t: (0.0, 0.0, 0.0),
    )  # fmt: skip
    wheel = SpatialBody(name="wheel", joint=Prescribed(motion=motion))
    system = TreeSystem(bodies=(wheel, IDLE), tyres=(tyre,), gravity=(0.0, 0.0, 0.0))
    one = simulate(system, np.ones(0), t_end, STEPS)
    force = one.tyre_forces().force[:, 0]
    own = [turned(t).T @ f for t, f in zip(one.times, force, strict=True)]
    return one.times, np.array(own)


def _pure_slip(*, lateral: bool) -> xr.Dataset:
    """A slow sweep of one slip from none to the largest, at three loads."""
    found, t_end = {}, 8.0
    for load in LOADS:
        sweep = (
            (lambda t: (0.0, SLIPS * t / t_end)) if lateral else (lambda t: (SLIPS * t / t_end, 0.0))
        )  # fmt: skip
        times, force = tyre_on_a_rig(load, sweep, t_end=t_end)
        found[f"{load / 1000:g} kN"] = np.abs(force[:, 1 if lateral else 0])
    return _dataset(slip=(SLIPS * times / t_end, "1"), **{k: (v, "N") for k, v in found.items()})


def _combined_slip() -> xr.Dataset:
    """Forces along and across for slips of one size in all directions, 7 kN: ellipses."""
    found: dict[str, Array] = {}
    for size in (0.03, 0.08, 0.3):

        def turning(t: float, size: float = size) -> tuple[float, float]:
            return size * cos(2 * pi * t / 8.0), tan(size * sin(2 * pi * t / 8.0))

        times, force = tyre_on_a_rig(7000.0, turning)
        settled = times > 0.05
        found |= {f"along at {size:g}": force[:, 0], f"across at {size:g}": force[:, 1]}
    return _dataset(**{name: (values[settled], "N") for name, values in found.items()})


def _relaxation() -> xr.Dataset:
    """Lateral force after a sudden slip angle of 3 deg, over the way rolled, at two speeds; 0.8 m."""
    found = {}
    for speed in (5.0, 20.0):
        times, force = tyre_on_a_rig(
            7000.0, lambda t: (0.0, tan(0.0524)), t_end=6.0 / speed, speed=speed, relaxation=0.8
        )
        found[f"{speed:g} m/s"] = np.abs(force[:, 1])
    return _dataset(way=(speed * times, "m"), **{name: (force, "N") for name, force in found.items()})


def _pulses() -> xr.Dataset:
    """The retractor's pull in time (8.28), and a spring in a window of time, both held at 10 mm."""
    times = np.linspace(0.0, 2.0, 401)
    stretched, still = np.full((401, 1), 0.01), np.zeros((401, 1))
    laws = {
        "retractor (8.28)": Retractor(),
        "spring from 0.3 to 1.1 s": Timed(law=Spring(k=4e4), start=0.3, end=1.1, rise=0.1),
    }
    found = {name: law_series([law], stretched, still, times).force[:, 0] for name, law in laws.items()}
    return _dataset(time=(times, "s"), **{name: (force, "N") for name, force in found.items()})


# drawing: (title, series on the x axis, label there, label on the y axis)
AXES = {
    "contact": ("contact, Hunt and Crossley's damping", "depth", "depth, mm", "normal force, N"),
    "friction": ("regularised friction, mu = 0.7", "speed", "sliding speed, m/s", "friction/normal force"),
    "bushing": ("bushing, 20 N/mm, cap 371 N", "apart", "separation, mm", "force, N"),
    "breakage": ("bushing that lets go at 80 mm", "apart", "separation, mm", "force, N"),
    "stops": ("stops of a joint at 0 and 142 deg", "angle", "angle, deg", "torque to hold it, N m"),
    "lateral": ("tyre, slip angle alone", "slip", "tangent of the slip angle", "lateral force, N"),
    "longitudinal": ("tyre, longitudinal slip alone", "slip", "longitudinal slip", "longitudinal force, N"),
    "combined": ("tyre, both slips, 7 kN", "along", "longitudinal force, N", "lateral force, N"),
    "relaxation": ("tyre, 3 deg at once, relaxation 0.8 m", "way", "way rolled, m", "lateral force, N"),
    "pulses": ("laws of time", "time", "time, s", "force, N"),
}  # fmt: skip
MILLIMETRES = ("depth", "apart")


def figures(found: Mapping[str, xr.Dataset]) -> dict[str, "Figure"]:
    """One drawing per element."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 6.4), layout="constrained")
    for ax, name in zip(figure.subplots(2, 5).flat, AXES, strict=True):
        _draw(ax, name, found[name])
    return {"element_laws": figure}


def _draw(ax: "Axes", name: str, ds: xr.Dataset) -> None:
    title, key, below, beside = AXES[name]
    styles = ("-", "--", ":")
    if name == "combined":
        sizes = [str(n).removeprefix("along at ") for n in ds if str(n).startswith("along")]
        for style, size in zip(styles, sizes, strict=True):
            ax.plot(ds[f"along at {size}"], ds[f"across at {size}"], style, label=f"size {size}")
        ax.set_aspect("equal", adjustable="datalim")
    elif name == "breakage":
        turn = int(np.argmax(ds.apart.to_numpy())) + 1
        ax.plot(1e3 * ds.apart[:turn], ds.force[:turn], "-", label="pulled")
        ax.plot(1e3 * ds.apart[turn:], ds.force[turn:], "--", label="brought back")
        ax.plot(1e3 * ds.apart[:turn], 100 * ds.damage[:turn], ":", label="damage, %")
    else:
        for style, series in zip(styles, [n for n in ds if n != key], strict=False):
            ax.plot((1e3 if key in MILLIMETRES else 1.0) * ds[key], ds[series], style, label=series)
    ax.set_title(title, fontsize=9)
    ax.set_xlabel(below)
    ax.set_ylabel(beside)
    if name == "pulses":
        ax.margins(y=0.25)  # room for the legend
    if name != "friction":
        ax.legend(frameon=False, fontsize=7)


if __name__ == "__main__":
    drawn = figures(run())
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/gallery/images")
    for name, figure in drawn.items():
        figure.savefig(folder / f"{name}.png", dpi=110)
        print(folder / f"{name}.png")

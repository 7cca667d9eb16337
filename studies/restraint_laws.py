"""Laws of restraints that an engineer asks for: what each does on a way out and back.

Webbing with slack, pretensioner and load limiter, a reel that locks, and an airbag with and without vents are
led through one slow swing; beside it, a man of 77 kg meets each in a frame that brakes. Work put in and given
back are integrals of the force along the way.

    python -m studies.restraint_laws [folder]      writes the figure
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from workbench.engine import (
    Airbag,
    Belt,
    Body,
    LockingRetractor,
    Member,
    System,
    VentedAirbag,
    Webbing,
    simulate,
)
from workbench.engine.elements.law_series import law_series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LAWS", "figures", "run", "thrown"]

T_END, NODES = 1.0, 2001
REACH = 0.12  # m, of the swing
FIRES = 0.05  # s
LAWS: dict[str, Any] = {
    "belt (8.26)": Belt(),
    "webbing, slack 20 mm": Webbing(k=5e3, slack=0.02, limit=300.0),
    "webbing, pretensioned": Webbing(k=5e3, slack=0.02, limit=300.0, pull=0.03, fires=FIRES),
    "reel that locks": LockingRetractor(k=5e3, limit=300.0, locks=0.02, tension=10.0),
    "airbag (8.27)": Airbag(),
    "airbag, vented": VentedAirbag(returned=0.0),
}


def run(seed: int = 0) -> xr.Dataset:
    """Force over a swing of each law, work put in and given back over it, and a man thrown against it.

    seed: nothing is drawn; it is taken so that all studies are called alike.

    Returns force (law, time) N, way (law, time) m, put_in and given_back (law) J, rebound (law): speed at
    which a man thrown at 1 m/s is thrown back, m/s.
    """
    time = np.linspace(0.0, T_END, NODES)
    names = list(LAWS)
    force, way = np.empty((len(names), NODES)), np.empty((len(names), NODES))
    put_in, given_back, rebound = np.empty(len(names)), np.empty(len(names)), np.empty(len(names))
    for row, (name, law) in enumerate(LAWS.items()):
        sign = -1.0 if "airbag" in name else 1.0
        way[row] = sign * REACH * np.sin(np.pi * time / T_END) ** 2
        rate = np.gradient(way[row], time)
        force[row] = law_series([law], way[row][:, None], rate[:, None], time).force[:, 0]
        power = force[row] * rate
        put_in[row] = np.trapezoid(np.maximum(power, 0.0), time)
        given_back[row] = -np.trapezoid(np.minimum(power, 0.0), time)
        rebound[row] = thrown(law, pushed="airbag" in name)
    return xr.Dataset(
        {
            "force": (("law", "time"), force, {"units": "N"}),
            "way": (("law", "time"), way, {"units": "m"}),
            "put_in": ("law", put_in, {"units": "J"}),
            "given_back": ("law", given_back, {"units": "J"}),
            "rebound": ("law", rebound, {"units": "m/s"}),
        },
        coords={"law": names, "time": ("time", time, {"units": "s"})},
    )


def thrown(law: Any, *, pushed: bool, speed: float = 1.0, count: int = 12) -> float:
    """The largest speed back, m/s, of a man of 77 kg thrown against `count` members of a law at once.

    Until he is where he started.

    pushed: towards the anchors, as against a bag; otherwise away from them.
    """
    side = 1.0 if pushed else -1.0
    man = Body(name="man", mass=77.0, inertia=10.0, velocity=(speed, 0.0, 0.0), gravity=False)
    members = tuple(Member(a="man", b="ground", point_b=(side, 0.0), law=law) for _ in range(count))
    run = simulate(System(bodies=(man,), members=members), np.ones(count), T_END, 4000)
    place, back = run.position[:, 0], -run.velocity[:, 0]
    home = np.flatnonzero((place <= 0.0) & (back > 0.0))
    return max(0.0, float(back[: home[0] + 1 if len(home) else None].max()))


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """Force over the way of each law: out and back."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 5.6), layout="constrained")
    axes = figure.subplots(2, 3)
    for ax, name in zip(axes.flat, ds.law.values, strict=True):
        one = ds.sel(law=name)
        turn = NODES // 2
        ax.plot(1e3 * one.way[: turn + 1], one.force[: turn + 1], color="#0072b2", label="there")
        ax.plot(1e3 * one.way[turn:], one.force[turn:], color="#d55e00", linestyle="--", label="back")
        share = 100.0 * float(one.given_back / one.put_in)
        ax.set_title(f"{name}: {share:.0f} % comes back", fontsize=9)
        ax.set_xlabel("elongation, mm")
        ax.set_ylabel("force, N")
    axes.flat[0].legend(frameon=False, fontsize=8)
    return {"restraint_laws": figure}


if __name__ == "__main__":
    found = run()
    print(f"{'law':24} {'put in, J':>10} {'back, J':>9} {'rebound from 1 m/s':>20}")
    for law in found.law.values:
        row = found.sel(law=law)
        print(f"{law:24} {float(row.put_in):10.2f} {float(row.given_back):9.2f} {float(row.rebound):20.3f}")
    for key, picture in figures(found).items():
        picture.savefig(Path(sys.argv[1] if len(sys.argv) > 1 else ".") / f"{key}.png", dpi=100)

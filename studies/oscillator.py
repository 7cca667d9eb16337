"""One mass on one spring, sections 5.4.1 and 6.3.1 of the dissertation: gradients against the closed form.

    x = v0/w sin(w t),   dx/dk = v0/(2 k) (t cos(w t) - sin(w t)/w),   w = sqrt(k/m)

(5.21) prints the second for m = 1 only.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from workbench.engine import (
    Body,
    Coordinate,
    GeneralisedAlpha,
    Member,
    Spring,
    System,
    Terminal,
    gradient,
    simulate,
)
from workbench.engine.sensitivity.gradient import METHODS

__all__ = ["Oscillator", "closed_form", "figures", "problem", "run"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Oscillator:
    """System, design, objective and horizon; the stiffness is k at density 1."""

    system: System
    density: Array
    objective: Terminal
    t_end: float
    steps: int
    scheme: GeneralisedAlpha
    mass: float
    stiffness: float
    speed: float


def problem(
    *, mass: float = 1.0, stiffness: float = 10.0, speed: float = 0.5, t_end: float = 5.0
) -> Oscillator:
    """G = x(t_end); m = 1 kg, k = 10 N/m, v0 = 0.5 m/s as printed.

    >>> problem().system.size
    3
    """
    body = Body(name="mass", mass=mass, inertia=1.0, velocity=(speed, 0.0, 0.0), gravity=False)
    spring = Member(a="mass", b="ground", point_b=(-10.0, 0.0), law=Spring(k=stiffness))
    return Oscillator(
        system=System(bodies=(body,), members=(spring,)), density=np.ones(1),
        objective=Terminal(quantity=Coordinate(bodies=("mass",), direction=(1.0, 0.0))),
        t_end=t_end, steps=500, scheme=GeneralisedAlpha(rho=0.8), mass=mass, stiffness=stiffness, speed=speed,
    )  # fmt: skip


def closed_form(p: Oscillator, t: Array | float) -> tuple[Any, Any]:
    """x(t) and dx/dalpha = k dx/dk."""
    w = np.sqrt(p.stiffness / p.mass)
    return p.speed / w * np.sin(w * t), 0.5 * p.speed * (t * np.cos(w * t) - np.sin(w * t) / w)


def run(seed: int = 0) -> xr.Dataset:
    """dx(T)/dalpha by every method at several step counts; the seed plays no part (nothing is drawn)."""
    p = problem()
    counts = [125, 250, 500, 1000]
    _, exact = closed_form(p, p.t_end)
    # at a terminal position of one spring the frozen load says nothing useful; it is in the two-body table
    methods = [name for name in METHODS if name != "constant_load"]
    error = np.zeros((len(methods), len(counts)))
    for column, steps in enumerate(counts):
        trajectory = simulate(p.system, p.density, p.t_end, steps, scheme=p.scheme)
        for row, method in enumerate(methods):
            found = gradient(p.system, p.density, trajectory, p.objective, method)[0]
            error[row, column] = abs(found - exact) / abs(exact)
    trajectory = simulate(p.system, p.density, p.t_end, p.steps, scheme=p.scheme)
    x, slope = closed_form(p, trajectory.times)
    return xr.Dataset(
        {
            "relative_error": (("sensitivity", "steps"), error),
            "position": ("time", trajectory.position[:, 0], {"units": "m"}),
            "exact_position": ("time", x, {"units": "m"}),
            "exact_gradient": ("time", slope, {"units": "m"}),
        },
        coords={"sensitivity": methods, "steps": counts, "time": ("time", trajectory.times, {"units": "s"})},
        attrs={"title": "oscillator: gradients against the closed form", "seed": seed},
    )


def figures(ds: xr.Dataset) -> Any:
    """Position against the closed form, and the error of every method over the number of steps."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(ds.time, ds.exact_position, label="closed form")
    left.plot(ds.time, ds.position, "--", label="generalised-alpha, 500 steps")
    left.set(xlabel="time [s]", ylabel="position [m]")
    left.set_ylim(-0.2, 0.28)
    left.legend(frameon=False, loc="upper center")
    markers = ("o-", "s--", "^-.", "v:", "D-", "x--", "+-.", "*:")
    for method, marker in zip(ds.sensitivity.values, markers, strict=True):
        error = ds.relative_error.sel(sensitivity=method)
        right.loglog(ds.steps, error, marker, markersize=5, markerfacecolor="none", label=str(method))
    right.set(xlabel="steps", ylabel="relative error of dx(T)/dα")
    right.set_ylim(1e-6, 60)
    right.legend(fontsize="x-small", ncols=2, frameon=False, loc="upper center")
    return figure


def main() -> None:
    """Print the table and save the figure."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    ds = run()
    print(ds.relative_error.to_pandas().to_string(float_format=lambda x: f"{x:.2e}"))
    figures(ds).savefig(folder / "oscillator.png", dpi=100)


if __name__ == "__main__":
    main()

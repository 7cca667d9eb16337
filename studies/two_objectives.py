"""Two load cases as two objectives, (7.17): a whole front where the dissertation shows one point.

Body 2 is turned with 20 rad/s^2 under gravity in the first case and pushed with 20 m/s^2 along x, without
gravity, in the second. The ground carries body 2: with gravity on both bodies a symmetric layout would not
move in the first case at all. The objective is the largest squared displacement of body 1 seen from body 2
(the stored energy of (7.12) rewards removing members). `python -m studies.two_objectives` draws the front
with layouts as thumbnails, like figures 7.9 to
7.11.
"""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from studies.two_body import layout_problem
from workbench.engine import Load
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.several import Front, front

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["figures", "problems", "run"]

SPIN, PUSH = 6000.0 * 20.0, 2000.0 * 20.0  # N m and N on body 2


def problems(case: str = "short") -> list[LayoutProblem]:
    """Rotation alone, then translation alone; in mm^2.

    >>> [p.title for p in problems()]
    ['rotation', 'translation']
    """
    record = layout_problem(case)
    first, second = record.system.bodies
    members = len(record.density)
    found = []
    for name, load, gravity in (
        ("rotation", Load(body="2", torque=SPIN), record.system.gravity),
        ("translation", Load(body="2", force=(PUSH, 0.0)), (0.0, 0.0)),
    ):
        system = replace(
            record.system, bodies=(first, replace(second, gravity=False)), loads=(load,), gravity=gravity
        )
        scenario = Scenario(
            system=system, objective=record.objective, t_end=record.t_end, steps=record.steps,
            scheme=record.scheme, scale=1e-6, name=name,
        )  # fmt: skip
        found.append(
            transient_problem(
                [scenario],
                start=record.density,
                budgets=[(np.ones(members), record.budget)],
                lower=record.lower,
                upper=record.upper,
                names=("material",),
                title=name,
                response=f"displacement^2, {name}",
                unit="mm^2",
            )
        )
    return found


def run(*, points: int = 15, evaluations: int = 15) -> xr.Dataset:
    """The front by normal boundary intersection."""
    return _dataset(front(problems(), points=points, max_evaluations=evaluations))


def _dataset(found: Front) -> xr.Dataset:
    return xr.Dataset(
        {
            "value": (("point", "objective"), found.values, {"units": "mm^2"}),
            "density": (("point", "member"), found.densities),
            "kept": ("point", found.kept),
            "utopia": ("objective", found.utopia, {"units": "mm^2"}),
            "nadir": ("objective", found.nadir, {"units": "mm^2"}),
        },
        coords={"objective": ["rotation", "translation"]},
        attrs={
            "knee": found.knee, "covered": found.covered, "evaluations": found.evaluations,
            "spacing": found.spacing.tolist(),
        },
    )  # fmt: skip


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """The front with the knee, and the layouts of both anchors and the knee as thumbnails."""
    from matplotlib.figure import Figure

    from workbench.figures.layout import plot_front, plot_layout

    figure = Figure(figsize=(9.0, 5.2), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=(3, 1))
    kept = np.flatnonzero(ds.kept.values)
    knee = int(np.flatnonzero(kept == ds.attrs["knee"])[0])
    ax = plot_front(
        ds.value.values[kept], labels=("displacement², rotation", "displacement², translation"),
        units=("mm²", "mm²"), knee=knee, utopia=ds.utopia.values, ax=figure.add_subplot(grid[:, 0]),
    )  # fmt: skip
    ax.set(xscale="log", yscale="log")  # the anchors are a hundred times apart
    geometry = problems()[0].geometry
    assert geometry is not None
    for row, (index, name) in enumerate(
        ((0, "rotation alone"), (ds.attrs["knee"], "knee"), (1, "translation alone"))
    ):
        ax = figure.add_subplot(grid[row, 1])
        members: list[dict[str, Any]] = [
            {"density": float(a), "point_a": geometry.point_a[i], "point_b": geometry.point_b[i]}
            for i, a in enumerate(ds.density.values[index])
        ]
        plot_layout(members, thickest=0.8, ax=ax)
        ax.set(title=name, xlabel="", ylabel="", xticks=[], yticks=[])
    return {"front": figure}


def main() -> None:
    """Print the front and save the figure."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    ds = run()
    for value, kept in zip(ds.value.values, ds.kept.values, strict=True):
        said = "" if kept else "dominated"
        print(f"rotation {value[0]:9.4f} mm^2   translation {value[1]:9.4f} mm^2   {said}")
    print(f"covered {ds.attrs['covered']:.4f} of the box, {ds.attrs['evaluations']} evaluations")
    figures(ds)["front"].savefig(folder / "two_objectives_front.png", dpi=120)


if __name__ == "__main__":
    main()

"""The three-body layout of chapter VII (7.13): 1,044 members, a revolute joint, sensitivities through the
DAE.

Figures like 7.6 to 7.8. `python -m studies.three_body_layout` prints the table and saves them.
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import xarray as xr

from studies.three_body import problem as three_bodies
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.purify import purify

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["figures", "problem", "run"]

ON_BODY_1 = 612  # members between bodies 1 and 2; the other 432 tie body 3 to body 2


def problem(
    *, domains: int = 1, share: float = 0.1, sensitivities: Literal["auto", "forward", "adjoint"] = "auto"
) -> LayoutProblem:
    """Largest squared displacement of the joined bodies seen from body 2, (7.13).

    domains: 1, or 2 for the budgets of (7.18), one for the members of each body.    share: of all material.

    >>> problem(domains=2).budgets
    2
    """
    record = three_bodies()
    N = len(record.density)
    first = (np.arange(N) < ON_BODY_1).astype(float)
    budgets = [(np.ones(N), share * N)]
    names: tuple[str, ...] = ("material",)
    if domains == 2:
        budgets = [(first, share * ON_BODY_1), (1 - first, share * (N - ON_BODY_1))]
        names = ("body 1", "body 3")
    elif domains != 1:
        raise ValueError(f"domains needs to be 1 or 2, got {domains}")
    return transient_problem(
        [Scenario(
            system=record.system, objective=record.objective, t_end=record.t_end, steps=record.steps,
            scheme=record.scheme,
        )],
        start=share, budgets=budgets, lower=1e-4, upper=1.0, sensitivities=sensitivities, names=names,
        title="three bodies", response="largest squared displacement", unit="m^2",
    )  # fmt: skip


def run(*, domains: int = 1, evaluations: int = 50) -> xr.Dataset:
    """The default method with both ways to gradients: the layouts agree, as in figure 7.6."""
    ways: tuple[Literal["forward", "adjoint"], ...] = ("forward", "adjoint")
    rows = []
    for way in ways:
        target = problem(domains=domains, sensitivities=way)
        result = optimise_layout(
            target, "gsao" if way == "forward" else "gsao_two_point", max_evaluations=evaluations
        )
        clean = purify(target, result.density)
        best = np.array([entry.best for entry in result.history])
        rows.append((np.r_[best, np.full(evaluations - len(best), best[-1])], clean, result))
    return xr.Dataset(
        {
            "best": (("way", "evaluation"), np.array([r[0] for r in rows]), {"units": "m^2"}),
            "density": (("way", "member"), np.array([r[1].density for r in rows])),
            "kkt": ("way", [r[2].kkt for r in rows]),
            "shadow_price": (
                ("way", "budget"),
                np.array([r[2].shadow_prices for r in rows]),
                {"units": "m^2"},
            ),
            "fractional": ("way", [r[1].fractional for r in rows]),
        },
        coords={"way": list(ways), "evaluation": np.arange(1, evaluations + 1)},
        attrs={"start_value": rows[0][2].start_value, "domains": domains},
    )


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """History, density and layout (figures 7.6 to 7.8, or 7.12 to 7.14 with two domains)."""
    from matplotlib.figure import Figure

    from workbench.figures.layout import plot_density, plot_layout

    history = Figure(figsize=(6.4, 3.2), layout="constrained")
    ax = history.add_subplot()
    for way, style, name in zip(
        ds.way.values, ("-", "--"), ("forward, min-max master", "adjoint, two-point GSAO"), strict=True
    ):
        ax.plot(ds.evaluation, ds.best.sel(way=way) / ds.attrs["start_value"], style, label=name)
    ax.set_xlabel("evaluation")
    ax.set_ylabel("best value / start")
    ax.legend(frameon=False)
    density = Figure(figsize=(6.4, 2.6), layout="constrained")
    plot_density(ds.density.values[0], ax=density.add_subplot())
    geometry = problem(domains=int(ds.attrs["domains"])).geometry
    assert geometry is not None
    drawing = Figure(figsize=(4.6, 5.2), layout="constrained")
    plot_layout(
        [
            {"density": float(a), "point_a": geometry.point_a[i], "point_b": geometry.point_b[i]}
            for i, a in enumerate(ds.density.values[0])
        ],
        ax=drawing.add_subplot(),
    )
    return {"history": history, "density": density, "layout": drawing}


def main(domains: int = 1, name: str = "three_body") -> None:
    """Print the table and save the figures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    ds = run(domains=domains)
    for way in ds.way.values:
        row = ds.sel(way=way)
        prices = ", ".join(f"{p:.4g}" for p in row.shadow_price.values)
        print(
            f"{way:8s} best/start {row.best.values[-1] / ds.attrs['start_value']:.6f}   "
            f"kkt {float(row.kkt):.1e}   fractional {int(row.fractional)}   shadow prices [m^2] {prices}"
        )
    for key, figure in figures(ds).items():
        figure.savefig(folder / f"{name}_{key}.png", dpi=120)


if __name__ == "__main__":
    main()

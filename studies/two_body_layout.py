"""The two-body layouts of chapter VII: 1,020 members, a budget of a tenth, methods side by side.

Figures like 7.3 (history), 7.4 (density) and 7.5 (layout). The dissertation gives neither coordinates nor
budget, so its curves cannot be met number for number; geometry S of `studies.two_body` stands in. Its drawing
shows all members with alpha > 0.1: set to 1 they break the budget, so ours shows every member as thick as it
is.

Run `python -m studies.two_body_layout` (about a minute) for the table and the figures.
"""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr

from studies.two_body import layout_problem
from workbench.engine import GeneralisedAlpha, gradient, simulate
from workbench.engine.layout.formulation.problem import LayoutProblem, static_problem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.purify import purify

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "METHODS", "SENSITIVITIES", "compare_sensitivities", "figures", "plot_sensitivities", "problem", "run",
]  # fmt: skip

SENSITIVITIES = (
    "discrete_adjoint", "adjoint", "time_integration", "iterative", "iterative_printed", "constant_load",
)  # fmt: skip
METHODS = ("gsao", "gsao_two_point", "oc", "mma", "gcmma", "dsqp", "slp")


def problem(
    case: str = "short",
    *,
    peak: str = "node",
    sensitivities: Literal["auto", "forward", "adjoint"] = "auto",
    power: float = 1.0,
    budget: float = 102.0,
) -> LayoutProblem:
    """The layout problem of a case: "short" (0.2 s), "long" (1 s, several peaks) or "energy" (degenerate).

    >>> problem("short").members
    1020
    """
    record = layout_problem(case, peak=peak)
    energy = case == "energy"
    return transient_problem(
        [Scenario(
            system=record.system, objective=record.objective, t_end=record.t_end, steps=record.steps,
            scheme=record.scheme, name=case,
        )],
        start=np.minimum(record.density, budget / len(record.density)),
        budgets=[(np.ones(len(record.density)), budget)],
        lower=record.lower,
        upper=record.upper,
        sensitivities=sensitivities,
        power=power,
        names=("material",),
        title=f"two bodies, {case}",
        response="largest stored energy" if energy else "largest squared displacement",
        unit="J" if energy else "m^2",
    )  # fmt: skip


def run(case: str = "short", *, methods: tuple[str, ...] = METHODS, evaluations: int = 50) -> xr.Dataset:
    """Every method from the uniform start: best value over its evaluations, density, purified density."""
    target = problem(case)
    best = np.full((len(methods), evaluations), np.nan)
    density, purified = (np.zeros((len(methods), target.members)) for _ in range(2))
    kkt, fractional, after, price = (np.zeros(len(methods)) for _ in range(4))
    verdict, loss, start = [], np.zeros(len(methods)), np.nan
    for i, method in enumerate(methods):
        result = optimise_layout(target, method, max_evaluations=evaluations)
        start = result.start_value
        values = np.array([entry.best for entry in result.history])
        best[i, : len(values)] = values
        best[i, len(values) :] = values[-1]
        density[i], kkt[i], price[i] = result.density, result.kkt, result.shadow_prices[0]
        clean = purify(target, result.density)
        purified[i], loss[i] = clean.density, clean.loss
        fractional[i], after[i] = clean.fractional_before, clean.fractional
        verdict.append(" ".join(result.verdicts))
    unit = target.unit
    return xr.Dataset(
        {
            "best": (("method", "evaluation"), best, {"units": unit}),
            "density": (("method", "member"), density),
            "purified": (("method", "member"), purified),
            "kkt": ("method", kkt),
            "shadow_price": ("method", price, {"units": unit}),
            "fractional": ("method", fractional),
            "fractional_purified": ("method", after),
            "loss": ("method", loss),
            "verdict": ("method", np.array(verdict, dtype=object)),
        },
        coords={"method": list(methods), "evaluation": np.arange(1, evaluations + 1)},
        attrs={"case": case, "start_value": start, "unit": unit},
    )


def compare_sensitivities(
    methods: tuple[str, ...] = SENSITIVITIES, *, update: str = "oc", evaluations: int = 50
) -> xr.Dataset:
    """The same update, fed with the gradient of each sensitivity method, on the short window.

    Chapter VII finds its layouts with the constant dynamic loading about a tenth worse. Values are those of
    the simulation whatever the gradient; the peak is refined, the scheme generalised-alpha.
    """
    record = layout_problem("short", peak="refined")
    scheme = GeneralisedAlpha(rho=0.8)
    best, seconds = np.zeros((len(methods), evaluations)), np.zeros(len(methods))
    for i, method in enumerate(methods):

        def value(density: Any, method: str = method) -> tuple[float, Any]:
            run = simulate(record.system, density, record.t_end, record.steps, scheme=scheme)
            slope = gradient(record.system, density, run, record.objective, method)
            return record.objective.value(run), slope

        target = static_problem(
            value, start=record.density, lower=record.lower, upper=record.upper,
            budgets=[(np.ones(len(record.density)), record.budget)],
        )  # fmt: skip
        begin = time.process_time()
        result = optimise_layout(target, update, max_evaluations=evaluations, tolerance=0.0)
        seconds[i] = time.process_time() - begin
        values = np.array([entry.best for entry in result.history])
        best[i] = np.r_[values, np.full(evaluations - len(values), values[-1])] / result.start_value
    return xr.Dataset(
        {
            "best": (("sensitivity", "evaluation"), best),
            "cpu": ("sensitivity", seconds, {"units": "s"}),
        },
        coords={"sensitivity": list(methods), "evaluation": np.arange(1, evaluations + 1)},
        attrs={"title": "sensitivity methods inside the optimisation", "update": update},
    )


def plot_sensitivities(ds: xr.Dataset) -> "Figure":
    """Best value over the evaluations for each sensitivity method."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = figure.add_subplot()
    for i, name in enumerate(ds.sensitivity.values):
        style = ("-", "--", "-.", ":")[i % 4]
        ax.plot(ds.evaluation, ds.best.sel(sensitivity=name), style, label=str(name))
    ax.set_xlabel("evaluation")
    ax.set_ylabel("best value / start")
    ax.legend(frameon=False, ncols=2, fontsize="small")
    return figure


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """History of all methods, density and layout of the first one (figures 7.3 to 7.5)."""
    from matplotlib.figure import Figure

    from workbench.figures.layout import plot_density, plot_layout

    history = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = history.add_subplot()
    for i, method in enumerate(ds.method.values):
        style = ("-", "--", "-.", ":")[i % 4]
        ax.plot(
            ds.evaluation, ds.best.sel({"method": method}) / ds.attrs["start_value"], style, label=str(method)
        )
    ax.set_xlabel("evaluation")
    ax.set_ylabel("best value / start")
    ax.legend(frameon=False, ncols=2)
    density = Figure(figsize=(6.4, 2.6), layout="constrained")
    plot_density(ds.purified.values[0], ax=density.add_subplot())
    drawing = Figure(figsize=(4.6, 4.6), layout="constrained")
    plot_layout(_drawn(problem(ds.attrs["case"]), ds.purified.values[0]), ax=drawing.add_subplot())
    return {"history": history, "density": density, "layout": drawing}


def _drawn(target: LayoutProblem, density: Any) -> list[dict[str, Any]]:
    geometry = target.geometry
    assert geometry is not None
    return [
        {"density": float(a), "point_a": geometry.point_a[i], "point_b": geometry.point_b[i]}
        for i, a in enumerate(density)
    ]


def main() -> None:
    """Print the table of both windows and save the figures beside."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    for case, methods in (
        ("short", METHODS),
        ("long", ("gsao", "gsao_two_point", "oc")),
        ("energy", ("gsao",)),
    ):
        ds = run(case, methods=methods)
        print(f"{case}: start {ds.attrs['start_value']:.6g} {ds.attrs['unit']}")
        for method in ds.method.values:
            row = ds.sel({"method": method})
            print(
                f"  {method:15s} best/start {row.best.values[-1] / ds.attrs['start_value']:.6f}   fractional "
                f"{int(row.fractional)} -> {int(row.fractional_purified)}, loss {100 * float(row.loss):.2g} %"
            )
        print("  " + str(ds.verdict.values[0]))
        for name, figure in figures(ds).items():
            figure.savefig(folder / f"two_body_{case}_{name}.png", dpi=120)
    compared = compare_sensitivities()
    for name in compared.sensitivity.values:
        row = compared.sel(sensitivity=name)
        print(f"  {name:18s} best/start {float(row.best[-1]):.4f}   CPU {float(row.cpu):.2f} s")
    plot_sensitivities(compared).savefig(folder / "two_body_sensitivities.png", dpi=120)


if __name__ == "__main__":
    main()

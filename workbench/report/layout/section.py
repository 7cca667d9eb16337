"""The layout: what it looks like, what it reached beside trivial layouts, members, shadow prices.

`layout.json`:

    response, unit, value          the objective of the layout, smaller is better
    baselines {name: value}        trivial layouts at the same budget (uniform, nominal-only, ...)
    trivial                        the name of the one that this layout is, None or nothing for others
    status, strategy, verdicts     sentences
    history [{evaluation, value, best}]
    members [{name, kind, density, a, b}]         ends (x, y) or (x, y, z) in length_unit at the start
    outlines [[[x, y], ...]]       bodies behind the drawing, optional
    matrix {rows, columns, cells}  names of the ends, and per member its (row, column), optional
    budgets [{name, limit, used}], purified {value, ...}     optional
    shadow_prices {limit: price}   improvement of the objective per unit of a limit
    scenarios [{name, value, parameters}]         value of the layout in each scenario
    gradient_check {method: largest relative error}, length_unit ("m")
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from workbench.figures.loop import plot_convergence
from workbench.figures.worst_case import plot_baselines
from workbench.report.layout.figures import THERE, drawing_figure, matrix_figures
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Note,
    Panel,
    Section,
    Table,
    number,
    quantity,
)
from workbench.report.page.folder import CampaignFolder

__all__ = ["improvement_sentence", "layout_section"]

MOST_OF = 0.9
SCENARIOS = 8  # up to so many stand open on the page; the loop lists its cases once more
PURIFIED = {
    "accepted": "taken instead of the layout",
    "before": "worst before",
    "value": "worst after",
    "fractional_before": "members between none and full before",
    "fractional": "members between none and full after",
    "excess": "budgets exceeded by",
}


def improvement_sentence(layout: Mapping[str, Any]) -> str:
    """The layout beside the best trivial one."""
    baselines = layout.get("baselines") or {}
    if layout.get("trivial"):
        return f"It is the layout '{layout['trivial']}' itself."
    if not baselines:
        return "No trivial layout was computed to compare with."
    name = min(baselines, key=lambda n: baselines[n])
    value, best = float(layout["value"]), float(baselines[name])
    if value >= best:
        return f"That is no better than the {name} layout ({number(best)})."
    # a share of a number that is not positive says nothing
    gain = f"{100 * (1 - value / best):.1f} %" if min(value, best) > 0 else number(best - value)
    return f"That is {gain} below the best trivial layout ({name}, {number(best)})."


def layout_section(folder: CampaignFolder) -> Section | None:
    """None without `layout.json`."""
    layout = folder["layout"]
    if layout is None:
        return None
    response, unit = str(layout["response"]), str(layout.get("unit") or "1")
    members = list(layout.get("members") or [])
    sentences = [
        f"The layout brings the worst {response} over its scenarios to {quantity(layout['value'], unit)}.",
        improvement_sentence(layout),
        _carried(members),
    ]
    if layout.get("status"):
        sentences.append(str(layout["status"]))
    if layout.get("strategy"):
        sentences.append(f"Solved by {layout['strategy']}.")
    sentences += [str(said) for said in (layout.get("whole") or {}).get("verdicts", ())]
    blocks: list[Block] = [Note(text=str(text)) for text in layout.get("verdicts") or ()]
    if members and all(m.get("a") and m.get("b") for m in members):
        blocks.append(drawing_figure(layout, members))
    if layout.get("matrix") and members:
        blocks += matrix_figures(layout["matrix"], members)
    if layout.get("history"):
        blocks.append(_convergence(layout, response, unit))
    if layout.get("baselines"):
        blocks.append(_comparison(layout, response, unit))
    blocks += _tables(layout, members, response, unit)
    return Section(
        id="layout",
        title="The layout",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={
            key: layout.get(key)
            for key in (
                "response",
                "unit",
                "value",
                "baselines",
                "shadow_prices",
                "scenarios",
                "gradient_check",
            )
        },
    )


def _carried(members: list[dict[str, Any]]) -> str:
    """How many members hold nine tenths of all density."""
    density = np.sort([float(m["density"]) for m in members])[::-1]
    if not len(density) or density.sum() <= 0:
        return "It has no members."
    count = int(np.searchsorted(np.cumsum(density), MOST_OF * density.sum())) + 1
    return f"{min(count, len(density))} of {len(density)} members hold nine tenths of all density."


def _convergence(layout: Mapping[str, Any], response: str, unit: str) -> Figure:
    history = [h for h in layout["history"] if h["value"] is not None]  # the model failed at the others
    baselines = {str(k): float(v) for k, v in (layout.get("baselines") or {}).items()}
    first, last = float(history[0]["value"]), float(layout["value"])
    return Figure(
        id="layout-history",
        title="How the optimiser got there",
        alt=f"Objective over {len(history)} evaluations, from {number(first)} to {number(last)}.",
        read_off="A stair that still falls at its end deserves more evaluations; a flat one may be at an "
        "optimum or stuck, which the first-order condition tells.",
        panels=(
            Panel(
                draw=lambda ax: plot_convergence(
                    history, baselines=baselines, label=f"worst {response}", unit=unit, ax=ax
                ),
                width=6.2,
                height=2.9,
            ),
        ),
        table=Table(
            id="layout-history",
            title="How the optimiser got there",
            columns=(
                Column(name="evaluation"),
                Column(name="value", unit=unit),
                Column(name="best", unit=unit),
            ),
            rows=tuple(
                (h.get("evaluation", k + 1), h["value"], h.get("best")) for k, h in enumerate(history)
            ),
        ),
    )


def _comparison(layout: Mapping[str, Any], response: str, unit: str) -> Figure:
    found = {
        "this layout": float(layout["value"]),
        **{str(k): float(v) for k, v in layout["baselines"].items()},
    }
    return Figure(
        id="layout-baselines",
        title="Beside trivial layouts",
        alt="Worst response of " + ", ".join(f"{name} {number(v)}" for name, v in found.items()) + ".",
        read_off="All layouts have the same budget; further left is better.",
        panels=(
            Panel(
                draw=lambda ax: plot_baselines(found, label=response, unit=unit, ax=ax),
                width=5.6,
                height=0.9 + 0.4 * len(found),
            ),
        ),
        table=Table(
            id="layout-baselines",
            title="Beside trivial layouts",
            columns=(Column(name="layout"), Column(name=f"worst {response}", unit=unit)),
            rows=tuple(found.items()),
        ),
    )


def _tables(
    layout: Mapping[str, Any], members: list[dict[str, Any]], response: str, unit: str
) -> list[Table]:
    """Those there are data for."""
    made: tuple[tuple[Any, Callable[[], Table]], ...] = (
        (members, lambda: _members(members)),
        (layout.get("budgets"), lambda: _budgets(layout["budgets"])),
        (layout.get("limits"), lambda: _limits(layout["limits"], response, unit)),
        (layout.get("purified"), lambda: _purified(layout["purified"])),
        (layout.get("shadow_prices"), lambda: _shadow_prices(layout["shadow_prices"], response, unit)),
        (layout.get("scenarios"), lambda: _scenarios(layout["scenarios"], response, unit)),
        (layout.get("gradient_check"), lambda: _gradient_check(layout["gradient_check"])),
    )
    return [make() for data, make in made if data]


def _members(members: list[dict[str, Any]]) -> Table:
    ranked = sorted(members, key=lambda m: -float(m["density"]))
    there = [m for m in ranked if float(m["density"]) > THERE]
    return Table(
        id="members",
        title=f"The {len(there)} of {len(members)} members with a density above {THERE:g}",
        columns=(Column(name="member"), Column(name="kind"), Column(name="density")),
        rows=tuple((m["name"], m["kind"], float(m["density"])) for m in there),
    )


def _budgets(budgets: list[dict[str, Any]]) -> Table:
    return Table(
        id="budgets",
        title="Budgets and what is used of them",
        columns=(Column(name="budget"), Column(name="limit"), Column(name="used")),
        rows=tuple((b["name"], b["limit"], b["used"]) for b in budgets),
    )


def _limits(limits: list[dict[str, Any]], response: str, unit: str) -> Table:
    return Table(
        id="limits",
        title="Limits of the runs and what loosening them would bring",
        columns=(
            Column(name="limit"), Column(name="bound"), Column(name="worst"), Column(name="unit"),
            Column(name="scenario"), Column(name="at", unit="s"),
            Column(name=f"improvement of {response} per unit of the limit", unit=unit),
        ),
        rows=tuple(
            (
                x["name"], f"{'at most' if x['upper'] else 'at least'} {number(x['bound'])}", x["value"],
                x["unit"], x["scenario"], x["time"], x["price"],
            )
            for x in limits
        ),
    )  # fmt: skip


def _purified(clean: Mapping[str, Any]) -> Table:
    return Table(
        id="purified",
        title="The layout with its densities driven to none or full, simulated again",
        columns=(Column(name="what"), Column(name="value")),
        rows=tuple((label, clean[key]) for key, label in PURIFIED.items() if key in clean),
    )


def _shadow_prices(prices: Mapping[str, Any], response: str, unit: str) -> Table:
    return Table(
        id="shadow-prices",
        title="What one more unit of a limit would bring",
        columns=(Column(name="limit"), Column(name=f"improvement of {response}", unit=unit)),
        rows=tuple(prices.items()),
    )


def _scenarios(scenarios: list[dict[str, Any]], response: str, unit: str) -> Table:
    return Table(
        id="scenarios",
        title="The layout in each of its scenarios",
        folded=len(scenarios) > SCENARIOS,
        columns=(Column(name="scenario"), Column(name=response, unit=unit), Column(name="parameters")),
        rows=tuple(
            (
                s.get("name", k + 1),
                s.get("value"),
                ", ".join(f"{n} = {number(v)}" for n, v in (s.get("parameters") or {}).items()),
            )
            for k, s in enumerate(scenarios)
        ),
    )


def _gradient_check(errors: Mapping[str, Any]) -> Table:
    return Table(
        id="gradient-check",
        title="Gradient against differences",
        columns=(Column(name="method"), Column(name="largest relative error")),
        rows=tuple(errors.items()),
    )

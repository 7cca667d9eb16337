"""The layout: what it looks like, what it reached beside trivial layouts, members, shadow prices.

`layout.json`:

    response, unit, value          the objective of the layout, smaller is better
    baselines {name: value}        trivial layouts at the same budget (uniform, nominal-only, ...)
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

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.figures.loop import plot_convergence, plot_layout_matrix, plot_members
from workbench.figures.worst_case import plot_baselines
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Note,
    Panel,
    Section,
    Table,
    names_of,
    number,
    quantity,
)
from workbench.report.page.folder import CampaignFolder

__all__ = ["improvement_sentence", "layout_section"]

MOST_OF = 0.9
THERE = 1e-3  # density of a member that is listed as there
SCENARIOS = 8  # up to so many stand open on the page; the loop lists its cases once more
PURIFIED = {
    "accepted": "taken instead of the layout",
    "before": "worst before",
    "value": "worst after",
    "fractional_before": "members between none and full before",
    "fractional": "members between none and full after",
    "excess": "budgets exceeded by",
}
DRAWING_WIDTH = 4.6  # inches of the axes in a drawing 6.4 wide


def improvement_sentence(layout: Mapping[str, Any]) -> str:
    """The layout beside the best trivial one."""
    baselines = layout.get("baselines") or {}
    if not baselines:
        return "No trivial layout was computed to compare with."
    name = min(baselines, key=lambda n: baselines[n])
    change = 1.0 - float(layout["value"]) / float(baselines[name]) if baselines[name] else 0.0
    if change <= 0:
        return f"That is no better than the {name} layout ({number(baselines[name])})."
    return f"That is {100 * change:.1f} % below the best trivial layout ({name}, {number(baselines[name])})."


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
    sentences += [str(layout[key]) for key in ("status", "strategy") if layout.get(key)]
    blocks: list[Block] = [Note(text=str(text)) for text in layout.get("verdicts") or ()]
    if members and all(m.get("a") and m.get("b") for m in members):
        blocks.append(_drawing(layout, members))
    if layout.get("matrix") and members:
        blocks += _matrices(layout["matrix"], members)
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


def _drawing(layout: Mapping[str, Any], used: list[dict[str, Any]]) -> Figure:
    length = str(layout.get("length_unit") or "m")
    kinds = {kind: sum(m["kind"] == kind for m in used) for kind in dict.fromkeys(m["kind"] for m in used)}
    said = names_of([f"{n} {kind}{'' if n == 1 else 's'}" for kind, n in kinds.items() if n])

    def draw(ax: Any) -> Any:
        return plot_members(used, outlines=layout.get("outlines") or (), unit=length, ax=ax)

    ends = np.array([[m["a"][:2], m["b"][:2]] for m in used], dtype=float).reshape(-1, 2)
    span = np.ptp(ends, axis=0)
    height = float(np.clip(1.0 + DRAWING_WIDTH * span[1] / max(span[0], 1e-9), 2.4, 6.5))
    return Figure(
        id="layout-drawing",
        title="What it looks like",
        alt=f"Drawing of {said} between body and vehicle, thickness by density.",
        read_off="Thickness is density relative to the largest; no threshold decides what is there. A belt "
        "is a plain line, an airbag a row of beads, a retractor dashes.",
        panels=(Panel(draw=draw, width=6.4, height=height),),
        table=Table(
            id="layout-drawing",
            title="Ends of the members",
            columns=(
                Column(name="member"), Column(name="kind"), Column(name="density"),
                Column(name="from", unit=length), Column(name="to", unit=length),
            ),
            rows=tuple((m["name"], m["kind"], m["density"], _point(m["a"]), _point(m["b"])) for m in used),
        ),
    )  # fmt: skip


def _matrices(matrix: Mapping[str, Any], members: list[dict[str, Any]]) -> list[Figure]:
    """A figure per kind: which end on one side is tied to which on the other, and how densely."""
    rows, columns = list(matrix["rows"]), list(matrix["columns"])
    tables: dict[str, Any] = {}
    for member, (i, j) in zip(members, matrix["cells"], strict=True):
        table = tables.setdefault(str(member["kind"]), np.full((len(rows), len(columns)), np.nan))
        table[i, j] = np.nansum([table[i, j], float(member["density"])])
    largest = max(float(np.nanmax(table)) for table in tables.values())
    return [_matrix(kind, table, rows, columns, largest) for kind, table in tables.items()]


def _matrix(kind: str, density: Any, rows: list[str], columns: list[str], largest: float) -> Figure:
    used = [(rows[i], columns[j], float(density[i, j])) for i, j in np.argwhere(density > THERE)]

    def draw(ax: Any) -> Any:
        return plot_layout_matrix(density, rows=rows, columns=columns, largest=largest, ax=ax)

    places = int((~np.isnan(density)).sum())
    return Figure(
        id=f"layout-matrix-{kind}",
        title=f"Which {kind} ties what to what",
        alt=f"Densities of kind {kind} by their ends: {len(used)} of {places} places are taken.",
        read_off="Each dot is a place for a member between the point of its row and the point of its column; "
        "the area of a square is the density.",
        panels=(Panel(draw=draw, width=2.0 + 0.14 * len(columns), height=1.4 + 0.2 * len(rows)),),
        table=Table(
            id=f"layout-matrix-{kind}",
            title=f"Places taken by kind {kind}",
            columns=(Column(name="from"), Column(name="to"), Column(name="density")),
            rows=tuple(used),
        ),
    )


def _point(p: Any) -> str:
    return ", ".join(number(float(v), 4) for v in p)


def _convergence(layout: Mapping[str, Any], response: str, unit: str) -> Figure:
    history = list(layout["history"])
    baselines = {str(k): float(v) for k, v in (layout.get("baselines") or {}).items()}
    first, last = float(history[0]["value"]), float(layout["value"])
    return Figure(
        id="layout-history",
        title="How the optimiser got there",
        alt=f"Objective over {len(history)} evaluations, from {number(first)} to {number(last)}.",
        read_off="A stair that is flat at its end has converged; one that still falls deserves more "
        "evaluations.",
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
) -> list[Block]:
    out: list[Block] = []
    if members:
        ranked = sorted(members, key=lambda m: -float(m["density"]))
        there = [m for m in ranked if float(m["density"]) > THERE]
        out.append(
            Table(
                id="members",
                title=f"The {len(there)} of {len(members)} members with a density above {THERE:g}",
                columns=(Column(name="member"), Column(name="kind"), Column(name="density")),
                rows=tuple((m["name"], m["kind"], float(m["density"])) for m in there),
            )
        )
    if layout.get("budgets"):
        out.append(
            Table(
                id="budgets",
                title="Budgets and what is used of them",
                columns=(Column(name="budget"), Column(name="limit"), Column(name="used")),
                rows=tuple((b["name"], b["limit"], b["used"]) for b in layout["budgets"]),
            )
        )
    if layout.get("purified"):
        clean = layout["purified"]
        out.append(
            Table(
                id="purified",
                title="The layout with its densities driven to none or full, simulated again",
                columns=(Column(name="what"), Column(name="value")),
                rows=tuple((label, clean[key]) for key, label in PURIFIED.items() if key in clean),
            )
        )
    if layout.get("shadow_prices"):
        out.append(
            Table(
                id="shadow-prices",
                title="What one more unit of a limit would bring",
                columns=(Column(name="limit"), Column(name=f"improvement of {response}", unit=unit)),
                rows=tuple(layout["shadow_prices"].items()),
            )
        )
    if layout.get("scenarios"):
        out.append(
            Table(
                id="scenarios",
                title="The layout in each of its scenarios",
                folded=len(layout["scenarios"]) > SCENARIOS,
                columns=(
                    Column(name="scenario"),
                    Column(name=response, unit=unit),
                    Column(name="parameters"),
                ),
                rows=tuple(
                    (
                        s.get("name", k + 1),
                        s.get("value"),
                        ", ".join(f"{n} = {number(v)}" for n, v in (s.get("parameters") or {}).items()),
                    )
                    for k, s in enumerate(layout["scenarios"])
                ),
            )
        )
    if layout.get("gradient_check"):
        out.append(
            Table(
                id="gradient-check",
                title="Gradient against differences",
                columns=(Column(name="method"), Column(name="largest relative error")),
                rows=tuple(layout["gradient_check"].items()),
            )
        )
    return out

"""Drawings of a layout: its members between their bodies, and which end is tied to which."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.figures.loop import plot_layout_matrix, plot_members
from workbench.report.page.blocks import Column, Figure, Panel, Table, names_of, number

__all__ = ["THERE", "drawing_figure", "matrix_figures"]

THERE = 1e-3  # density of a member that is listed as there
DRAWING_WIDTH = 4.6  # inches of the axes in a drawing 6.4 wide


def drawing_figure(layout: Mapping[str, Any], used: list[dict[str, Any]]) -> Figure:
    """The members in the plane, thickness by density."""
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


def matrix_figures(matrix: Mapping[str, Any], members: list[dict[str, Any]]) -> list[Figure]:
    """A figure per kind: which end on one side is tied to which on the other, and how densely."""
    rows, columns = list(matrix["rows"]), list(matrix["columns"])
    tables: dict[str, Any] = {}
    for member, (i, j) in zip(members, matrix["cells"], strict=True):
        table = tables.setdefault(str(member["kind"]), np.full((len(rows), len(columns)), np.nan))
        table[i, j] = np.nansum([table[i, j], float(member["density"])])
    largest = max(float(np.nanmax(table)) for table in tables.values())
    return [
        _matrix(kind, table, rows=rows, columns=columns, largest=largest) for kind, table in tables.items()
    ]


def _matrix(kind: str, density: Any, *, rows: list[str], columns: list[str], largest: float) -> Figure:
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

"""The design: how it was made, and how good it is beside random Latin hypercubes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

import doe
from workbench.figures.design import plot_distances
from workbench.figures.runs import beats, plot_percentiles
from workbench.report.lines.design import table_sentences
from workbench.report.lines.statements import sentence
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
)
from workbench.report.page.folder import CampaignFolder
from workbench.sampling.plan import Design
from workbench.sampling.verdict import cost_of_design, cost_of_growth

__all__ = ["design_section"]

MOST_RUNS = 5000  # distances are n^2

ALGORITHMS = {
    "lhs": "random Latin hypercube",
    "optimised_lhs": "optimised Latin hypercube",
    "ihs": "improved hypercube sampling (IHS)",
    "d_optimal_select": "Latin hypercube points selected for D-optimality",
    "d_optimal_within": "Latin hypercube with D-optimal columns",
    "sobol": "Sobol' sequence",
    "halton": "Halton sequence",
    "grid": "grid",
    "factorial": "factorial design",
    "table": "given table of runs",
}


def design_section(folder: CampaignFolder) -> Section | None:
    """None without `design.json`."""
    design = folder["design"]
    if design is None:
        return None
    n, d = int(design["n"]), int(design["d"])
    algorithm = str(design["algorithm"])
    sentences = [
        f"{n} runs of {d} parameters: {ALGORITHMS.get(algorithm, algorithm)}, seed {design.get('seed')}."
    ]
    used = {
        key: value for key, value in sorted(dict(design.get("options") or {}).items()) if value is not None
    }
    if used:
        sentences.append("Options: " + ", ".join(f"{key} = {number(v)}" for key, v in used.items()) + ".")
    for cost in (cost_of_design(design), cost_of_growth(design)):
        if cost is not None:
            sentences.append(sentence(cost))
    blocks: list[Block] = []
    blocks += [Note(text=sentence(said), level="fair") for said in table_sentences(design)]
    quality: dict[str, dict[str, Any]] = {
        str(name): dict(q) for name, q in (design.get("quality") or {}).items() if isinstance(q, dict)
    }
    if quality:
        blocks.append(_quality(quality))
    if "unit" in design and 2 <= n <= MOST_RUNS:
        blocks.append(_distances(design))
    blocks.append(
        Table(
            id="parameters",
            title="Parameters and their ranges",
            columns=tuple(
                Column(name=name)
                for name in ("parameter", "lower", "upper", "unit", "kind", "baseline", "label")
            ),
            rows=tuple(
                (
                    name,
                    p.get("lower"),
                    p.get("upper"),
                    p.get("unit") or "1",
                    _kind(p),
                    p.get("baseline"),
                    p.get("label") or "",
                )
                for name, p in folder.parameters.items()
            ),
        )
    )
    return Section(
        id="design",
        title="The design",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={"n": n, "d": d, "algorithm": algorithm, "seed": design.get("seed"), "quality": quality},
    )


def _distances(design: Mapping[str, Any]) -> Figure:
    made = Design.from_dict(design)
    nearest = doe.nearest_distances(made.unit)
    return Figure(
        id="distances",
        title="Distance to the nearest run",
        alt=f"Histogram of the distances of {len(nearest)} runs to their nearest neighbours, from "
        f"{number(float(nearest.min()))} to {number(float(nearest.max()))}.",
        read_off="Far right and narrow is good: runs that stand close together say nearly the same. Grey is "
        "a random Latin hypercube of the same size.",
        panels=(Panel(draw=lambda ax: plot_distances(made, ax=ax), width=5.4, height=2.8),),
        table=Table(
            id="distances",
            title="Distance to the nearest run",
            columns=(Column(name="run"), Column(name="distance to the nearest, side of the cube = 1")),
            rows=tuple(zip(made.run_ids, nearest.tolist(), strict=True)),
        ),
    )


def _kind(p: Any) -> str:
    kind = str(p.get("kind") or "continuous")
    levels = p.get("levels")
    if levels:
        return f"{kind}: {', '.join(number(v) for v in levels)}"
    return f"{kind}, step {number(p['step'])}" if p.get("step") else kind


def _quality(quality: dict[str, dict[str, Any]]) -> Figure:
    placed = {name: share for name, q in quality.items() if (share := beats(q)) is not None}
    low = [name.replace("_", " ") for name, share in placed.items() if share < 50]
    read_off = (
        "Right of the dashed line the design is better than half of the random Latin hypercubes of its size,"
        " on the same levels."
    )
    if placed:
        read_off += f" It is not in {names_of(low)}." if low else " It is so in every quality."
    share = float(np.mean(list(placed.values()))) if placed else 0.0
    return Figure(
        id="quality",
        title="Quality of the design",
        alt=f"{len(placed)} qualities of the design as percentiles among random Latin hypercubes, "
        f"{share:.0f} % on average.",
        read_off=read_off,
        panels=(
            (
                Panel(
                    draw=lambda ax: plot_percentiles(quality, ax=ax),
                    width=6.0,
                    height=0.9 + 0.34 * len(placed),
                ),
            )
            if placed
            else ()
        ),
        table=Table(
            id="quality",
            title="Quality of the design",
            columns=(
                Column(name="quality"),
                Column(name="value"),
                Column(name="better when"),
                Column(name="better than random hypercubes", unit="%"),
            ),
            rows=tuple(
                (name.replace("_", " "), q.get("value"), q.get("better"), placed.get(name))
                for name, q in quality.items()
            ),
        ),
    )

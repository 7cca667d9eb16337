"""How good a design is, alone and beside others."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from workbench.models.stored.dwarfing import dwarfing_sentence
from workbench.models.table import ignored_sentence
from workbench.report.lines.tables import fitted, format_number, table_lines, wrapped
from workbench.sampling.verdict import cost_of_design, cost_of_growth

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["comparison_lines", "design_lines", "table_sentences"]

WIDTH = 79
QUALITIES = ("min_distance", "cd2", "max_correlation", "d_efficiency")


def design_lines(document: Mapping[str, Any], *, whole: bool = False) -> list[str]:
    """How good the design is, each measure beside random Latin hypercubes of the same size and levels, and
    what it costs where it is poor; some measures, or all. Then what is to be told of a table of runs."""
    quality = document.get("quality") or {}
    rows = []
    for name in quality if whole else QUALITIES:
        entry = quality.get(name)
        if entry is None or entry["value"] is None or entry["percentile"] is None:
            continue
        beaten = entry["percentile"] if entry["better"] == "high" else 100 - entry["percentile"]
        rows.append((name.replace("_", " "), f"better than {beaten:.0f} %", format_number(entry["value"], 4)))
    lines = table_lines(("design quality", "of random Latin hypercubes", "value"), rows) if rows else []
    cost = cost_of_design(document) if rows else None
    lines += fitted(said for said in (cost, cost_of_growth(document)) if said is not None)
    for said in table_sentences(document):
        lines += wrapped(said, WIDTH)
    return lines


def table_sentences(document: Mapping[str, Any]) -> list[str]:
    """What is to be told of a table of runs: values that dwarf all others, columns that nobody reads."""
    said = [dwarfing_sentence(seen) for seen in document.get("dwarfing") or ()]
    names = document.get("ignored_columns")
    return [*said, ignored_sentence(names, str(document["options"]["file"]))] if names else said


def comparison_lines(frame: "pd.DataFrame") -> list[str]:
    """The table of `workbench.compare`: value, and share of random Latin hypercubes beaten, per design."""
    designs = list(dict.fromkeys(frame.columns.get_level_values(0)))
    rows = []
    for metric, row in frame.iterrows():
        cells = [str(metric).replace("_", " ")]
        for name in designs:
            value, beaten = row[name, "value"], row[name, "better than"]
            share = "" if math.isnan(beaten) else f" ({beaten:.0f} %)"
            cells.append(
                "-" if value is None or math.isnan(value) else format_number(float(value), 4) + share
            )
        rows.append(tuple(cells))
    lines = table_lines(("design quality", *designs), rows)
    return [*lines, "in brackets: share of random Latin hypercubes that the design is better than"]

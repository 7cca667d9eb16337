"""Runs whose value dwarfs all others: a placeholder such as 1e30, a unit mixed up, a run that diverged.

Responses of an honest model may blow up by decades, so a value is held against the tail of its own table. Of
the magnitudes m_1 >= m_2 >= ... >= m_n the spacings

    s_i = i log(m_i / m_i+1)

are independent and exponential with one mean where the tail is a power of 1/m (Renyi 1953; their average over
the largest is Hill's estimate, 1975), and their mean falls towards the end of every lighter tail. The k
largest dwarf the others where m_k is more than LEAST_RATIO times m_k+1 and

    s_k > q (c^(-1/q) - 1) mean(s_k+1 ... s_k+q),    c = CHANCE

which a power tail exceeds with chance c: the quotient of an exponential spacing and the mean of q others.
More than ENOUGH_RATIO times is beyond any tail.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from workbench.models.table import read_cells, read_table
from workbench.models.values import is_value
from workbench.space.units import number, raised

__all__ = ["Dwarfing", "dwarfing", "dwarfing_runs", "dwarfing_sentence"]

LEAST_RATIO = 1e4  # blow-ups by three decades are met in honest responses
ENOUGH_RATIO = 1e12  # whatever the tail
CHANCE = 1e-2  # of a quotient of spacings as large, where the tail is a power
SHARE = 0.1  # of the values may dwarf the others; one always may
FEWEST_OTHERS = 5
MOST_SPACINGS = 20
SHOWN = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Dwarfing:
    """`runs`: places of the values that dwarf the others, the largest first; `low`, `high`: what the others
    range over."""

    runs: tuple[int, ...]
    values: tuple[float, ...]
    low: float
    high: float


def dwarfing(values: Sequence[float | None]) -> Dwarfing | None:
    """The values that dwarf all others, None where none does. None among the values is a failed run.

    >>> dwarfing([1.0, 2.0, 1e30, 0.5, None, 1.5, 3.0, 2.5]).runs
    (2,)
    >>> dwarfing([1.0, 2.0, 900.0, 0.5, 1.5, 3.0, 2.5]) is None
    True
    """
    there = [k for k, value in enumerate(values) if value is not None and is_value(value)]
    y = np.array([values[k] for k in there], dtype=float)
    order = np.argsort(-np.abs(y), kind="stable")
    size = np.abs(y[order])
    found = 0
    for k in range(1, max(int(SHARE * len(y)), 1) + 1):
        if len(y) - k >= FEWEST_OTHERS and _is_torn(size, k):
            found = k
    if not found:
        return None
    rest = y[order[found:]]
    return Dwarfing(
        runs=tuple(there[i] for i in order[:found]),
        values=tuple(float(y[i]) for i in order[:found]),
        low=float(rest.min()),
        high=float(rest.max()),
    )


def _is_torn(size: np.ndarray, k: int) -> bool:
    """Whether the k largest of falling magnitudes (n,) stand apart from the tail below them."""
    below = size[k:][size[k:] > 0]
    q = min(len(below) // 2, MOST_SPACINGS)
    if not len(below) or size[k - 1] <= LEAST_RATIO * below[0]:
        return False
    if q < 1 or size[k - 1] > ENOUGH_RATIO * below[0]:
        return bool(size[k - 1] > ENOUGH_RATIO * below[0])
    spacings = np.arange(k + 1, k + q + 1) * np.log(below[:q] / below[1 : q + 1])
    bar = q * (CHANCE ** (-1 / q) - 1) * float(spacings.mean())
    return bool(k * log(size[k - 1] / below[0]) > bar)


def dwarfing_runs(
    path: Path, units: Mapping[str, str], *, columns: Mapping[str, str], first: int | None = None
) -> list[dict[str, Any]]:
    """Of a table of runs, for each response that holds such values: which lines of the file they stand in,
    and what the other runs range over. `units`: by response. `first`: how many rows are read, all by default.
    """
    rows = read_table(path, (), tuple(units), columns=columns, complete=False)[:first]
    lines = [line for line, _ in read_cells(path)[1]]
    seen = []
    for response, unit in units.items():
        found = dwarfing([row[response] for row in rows])
        if found is not None:
            at = [lines[k] for k in found.runs]
            seen.append({
                "response": response, "unit": unit, "file": path.name, "lines": at,
                "values": list(found.values), "low": found.low, "high": found.high,
            })  # fmt: skip
    return seen


def dwarfing_sentence(seen: Mapping[str, Any]) -> str:
    """What to tell a reader of one response with such values.

    >>> seen = {"response": "y", "unit": "N", "file": "runs.csv", "low": 0.5, "high": 3.0}
    >>> dwarfing_sentence({**seen, "lines": [4], "values": [1e30]})[:72]
    'Line 4 of runs.csv gives y = 1e+30 N, all other runs from 0.5 to 3 N: wh'
    """
    unit = "" if seen["unit"] in ("", "1") else f" {raised(seen['unit'])}"
    lines, values = seen["lines"], list(dict.fromkeys(number(value) for value in seen["values"]))
    one = len(lines) == 1
    more = f" and {len(lines) - SHOWN} more" if len(lines) > SHOWN else ""
    which = f"Line{'' if one else 's'} {', '.join(map(str, lines[:SHOWN]))}{more} of {seen['file']}"
    given = f"{values[0]}" if len(values) == 1 else f"{values[-1]} to {values[0]}"
    it, is_it = ("it", "it is") if one else ("them", "they are")
    return (
        f"{which} give{'s' if one else ''} {seen['response']} = {given}{unit}, all other runs from "
        f"{number(seen['low'])} to {number(seen['high'])}{unit}: what is found of {seen['response']} rests "
        f"on {'that one value' if one else 'those values'}. Where {is_it} a placeholder, a run that failed "
        f"or another unit, mend {it} or leave the cell empty; a true value may stay"
    )

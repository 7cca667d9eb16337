"""Water flow through a borehole between two aquifers: the table study, 64 runs of an 8-parameter model.

The formula (Harper & Gupta 1983; Morris, Mitchell & Ylvisaker 1993, Technometrics 35) is a standard test of
metamodels with units. `python -m studies.borehole` writes `studies/borehole.csv`, which `borehole.toml`
treats as runs that somebody made elsewhere: screening works, a worst case is the surrogate's, unconfirmed.
"""

import csv
import math
from pathlib import Path

import numpy as np
from scipy.stats import qmc

__all__ = ["BOX", "MAXIMUM", "TABLE", "borehole", "rows", "worst_corner", "write_table"]

TABLE = Path(__file__).with_name("borehole.csv")

# name -> (lower, upper, unit)
BOX = {
    "rw": (0.05, 0.15, "m"),
    "r": (100.0, 50_000.0, "m"),
    "Tu": (63_070.0, 115_600.0, "m^2/yr"),
    "Hu": (990.0, 1_110.0, "m"),
    "Tl": (63.1, 116.0, "m^2/yr"),
    "Hl": (700.0, 820.0, "m"),
    "L": (1_120.0, 1_680.0, "m"),
    "Kw": (9_855.0, 12_045.0, "m/yr"),
}

# m^3/yr, at `worst_corner()`; a corner because the flow is monotone in each of the eight parameters
MAXIMUM = 309.5755877

RUNS = 64
SEED = 64
SIGNIFICANT_DIGITS = 6


def borehole(
    *, rw: float, r: float, Tu: float, Hu: float, Tl: float, Hl: float, L: float, Kw: float
) -> float:  # the paper's letters
    """Flow through the borehole in m^3/yr.

        flow = 2 pi Tu (Hu - Hl) / ( ln(r/rw) [1 + 2 L Tu / (ln(r/rw) rw^2 Kw) + Tu/Tl] )

    Args:
        rw: radius of the borehole, m.
        r: radius of influence, m.
        Tu: transmissivity of the upper aquifer, m^2/yr.
        Hu: potentiometric head of the upper aquifer, m.
        Tl: transmissivity of the lower aquifer, m^2/yr.
        Hl: potentiometric head of the lower aquifer, m.
        L: length of the borehole, m.
        Kw: hydraulic conductivity of the borehole, m/yr.

    >>> round(borehole(**worst_corner()), 7) == MAXIMUM
    True
    """
    log_ratio = math.log(r / rw)
    resistance = log_ratio * (1.0 + 2.0 * L * Tu / (log_ratio * rw**2 * Kw) + Tu / Tl)
    return 2.0 * math.pi * Tu * (Hu - Hl) / resistance


def worst_corner() -> dict[str, float]:
    """The corner of the box with the largest flow."""
    high = {"rw", "Tu", "Hu", "Tl", "Kw"}
    return {name: upper if name in high else lower for name, (lower, upper, _) in BOX.items()}


def rows() -> list[dict[str, float]]:
    """The 64 runs: a Latin hypercube rounded to six digits, each with its `flow` for the rounded inputs."""
    unit = qmc.LatinHypercube(d=len(BOX), rng=np.random.default_rng(SEED)).random(RUNS)
    runs = []
    for point in unit:
        inputs = {
            name: float(f"{lower + u * (upper - lower):.{SIGNIFICANT_DIGITS}g}")
            for u, (name, (lower, upper, _)) in zip(point, BOX.items(), strict=True)
        }
        runs.append({**inputs, "flow": borehole(**inputs)})
    return runs


def write_table(path: Path = TABLE) -> Path:
    """Write the 64 runs as CSV with full precision: names in the first line, then one line per run."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [*BOX, "flow"], lineterminator="\n")
        table.writeheader()
        table.writerows({name: repr(value) for name, value in row.items()} for row in rows())
    return path


if __name__ == "__main__":
    print(write_table())

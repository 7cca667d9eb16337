"""What the presets reach on drawn trusses in 30 and 60 evaluations, and what they say of it.

Ground structures of 3 to 5 columns and 3 or 4 rows, drawn width, height and load cases at the far end; from
the even truss and from random areas. The optimum is that of the default with second derivatives.

Run `python -m studies.presets_on_trusses 20 12 2` for the table (80 s; first seed, number of trusses, load
cases).
"""

import sys
import time
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from studies import trusses
from workbench.engine.layout.optimise import optimise_layout

__all__ = ["Reached", "drawn", "run", "summary"]

METHODS = ("gsao_two_point", "gcmma", "mma", "conlin", "oc", "dsqp", "slp")


@dataclass(frozen=True, slots=True, kw_only=True)
class Reached:
    """half, whole: value over the optimum less 1 after half and all of the evaluations    kkt: first-order
    error    cpu: s"""

    method: str
    half: float
    whole: float
    status: str
    kkt: float
    cpu: float


def drawn(seed: int, cases: int = 2) -> trusses.Truss:
    """A truss with so many load cases of one force each.

    >>> len(drawn(20).ends)
    74
    """
    rng = np.random.default_rng([seed, 391])
    columns, rows = int(rng.integers(3, 6)), int(rng.integers(3, 5))
    width, height = rng.uniform(1, 4, 2)
    loads = []
    for _ in range(cases):
        angle = rng.uniform(0, 2 * np.pi)
        at = (width, int(rng.integers(0, rows)) * height / (rows - 1))
        loads.append((((np.cos(angle), np.sin(angle)), at),))
    return trusses.ground_structure(columns=columns, rows=rows, width=width, height=height, loads=loads)


def run(
    seed: int, cases: int = 2, *, methods: tuple[str, ...] = METHODS, evaluations: int = 60
) -> list[Reached]:
    """Every preset from two starts of a drawn truss."""
    truss = drawn(seed, cases)
    least = optimise_layout(trusses.problem(truss), max_evaluations=100, tolerance=1e-9).value
    n, found = len(truss.ends), []
    for areas in (np.ones(n), np.random.default_rng(seed).random(n) ** 2 + 0.01):
        start = areas / (truss.lengths @ areas)
        problem = trusses.problem(truss, lower=1e-7 / truss.lengths.sum(), second_order=False)
        for method in methods:
            began = time.process_time()
            result = optimise_layout(
                replace(problem, start=start), method, max_evaluations=evaluations, tolerance=1e-9
            )
            half = min(entry.best for entry in result.history[: evaluations // 2])
            found.append(Reached(
                method=method, half=half / least - 1, whole=result.value / least - 1,
                status=result.status.name, kkt=result.kkt, cpu=time.process_time() - began,
            ))  # fmt: skip
    return found


def summary(rows: list[Reached]) -> list[str]:
    """A line for each method: median and worst after 30 and 60 evaluations, statuses, errors behind them."""
    lines = []
    for method in dict.fromkeys(row.method for row in rows):
        here = [row for row in rows if row.method == method]
        said = f"{method:15s}"
        for name, values in (("half", [row.half for row in here]), ("all", [row.whole for row in here])):
            said += f" {name}: median {np.median(values):.4f} worst {max(values):.3f} "
        statuses = Counter(row.status for row in here)
        said += " ".join(
            f"{count} {status} (error at most {max(r.kkt for r in here if r.status == status):.1e})"
            for status, count in statuses.items()
        )
        lines.append(f"{said}  {sum(row.cpu for row in here):.1f} CPU s")
    return lines


def main() -> None:
    """Print the table."""
    given = [int(word) for word in sys.argv[1:4]]
    first, count, cases = given + [20, 12, 2][len(given) :]
    rows = [row for seed in range(first, first + count) for row in run(seed, cases)]
    print(*summary(rows), sep="\n")


if __name__ == "__main__":
    main()

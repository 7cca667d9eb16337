"""Do two designs of 64 runs of a real solver name the same drivers, and those that 2 000 runs name?

The reference is `reference.csv`: 2 000 points of a scrambled Sobol' sequence, each a run of ngspice 39. Its
total indices come from a regression on all products of Legendre polynomials up to degree 3, which shares
nothing with a Kriging screening; the regression says itself how well it predicts left-out runs.

    python -m studies.buck_converter.drivers 1 2      # seeds of the designs; needs ngspice
"""

import csv
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
from numpy.polynomial import legendre

from workbench.sampling.plan import make_design
from workbench.screening.kriging import screen
from workbench.screening.record import Screening
from workbench.space.box import Space
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study

__all__ = ["STUDY", "Reference", "reference", "reference_runs", "screened"]

STUDY = Path(__file__).with_name("buck.toml")
RUNS = 64
DEGREE = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """Total indices of a response, and how well the regression behind them predicts left-out runs."""

    response: str
    totals: Mapping[str, float]
    q2: float

    def above(self, share: float) -> set[str]:
        """The parameters whose total index exceeds `share`."""
        return {name for name, index in self.totals.items() if index > share}


def reference_runs() -> list[dict[str, float]]:
    """The 2 000 stored runs: parameters and responses by name."""
    with STUDY.with_name("reference.csv").open(newline="") as file:
        return [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]


def reference(response: str, runs: Sequence[Mapping[str, float]], space: Space) -> Reference:
    """Total indices by regression on orthonormal polynomials: T_i is the sum of squares of terms with i."""
    cube = 2 * space.unit([[run[name] for name in space.names] for run in runs]) - 1
    powers = np.stack(
        [np.sqrt(2 * k + 1) * legendre.legval(cube, [0.0] * k + [1.0]) for k in range(DEGREE + 1)]
    )
    terms = [
        term
        for degree in range(DEGREE + 1)
        for term in combinations_with_replacement(range(len(space.names)), degree)
    ]
    columns = [np.prod([powers[term.count(i), :, i] for i in set(term)], axis=0) for term in terms[1:]]
    basis = np.column_stack([np.ones(len(runs)), *columns])
    y = np.array([run[response] for run in runs])
    q, r = np.linalg.qr(basis)
    squares = np.linalg.solve(r, q.T @ y) ** 2
    left_out = (y - q @ (q.T @ y)) / (1 - (q**2).sum(axis=1))
    whole = squares[1:].sum()
    totals = {
        name: float(sum(squares[n] for n, term in enumerate(terms) if i in term) / whole)
        for i, name in enumerate(space.names)
    }
    return Reference(response=response, totals=totals, q2=float(1 - np.mean(left_out**2) / y.var()))


def screened(seed: int) -> dict[str, Screening]:
    """Screenings of every response from a fresh design of 64 runs of ngspice."""
    with tempfile.TemporaryDirectory() as away:
        for name in (STUDY.name, "buck.cir.tmpl"):
            shutil.copy(STUDY.with_name(name), away)
        with Campaign.from_file(Path(away, STUDY.name)) as campaign:
            study = load_study(Path(away, STUDY.name))
            runs = campaign.evaluate(make_design(study.space, "optimised_lhs", RUNS, seed=seed).rows())
    return {
        response.name: screen(runs, study.space, response, transform="auto", seed=seed)
        for response in study.responses
    }


def main() -> int:
    """Print a table: the drivers of each design beside those above 1 % and 5 % of the variance."""
    space = load_study(STUDY).space
    runs = reference_runs()
    designs = {int(seed): screened(int(seed)) for seed in sys.argv[1:] or ("1", "2")}
    missed = 0
    for response in next(iter(designs.values())):
        truth = reference(response, runs, space)
        ranked = sorted(truth.totals.items(), key=lambda item: -item[1])
        print(f"\n{response}: total indices of 2 000 runs (Q2 = {truth.q2:.4f})")
        print("  " + ", ".join(f"{name} {index:.3f}" for name, index in ranked if index > 0.002))
        for seed, found in designs.items():
            names = found[response].selected
            print(f"  seed {seed}: {found[response].verdict}")
            print(f"    {', '.join(names)}")
            missed += len(truth.above(0.05) - set(names))
    print(f"\ndrivers above 5 % that a design missed: {missed}")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())

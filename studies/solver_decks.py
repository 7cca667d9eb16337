"""Decks of real solvers: do two designs of few runs name the same drivers, and those that 2 000 runs name?

    buck        a buck converter starts, 16 parameters            ngspice
    amplifier   gain, band, distortion of an amplifier, 20        ngspice
    bracket     finite elements of a bracket, 15                  CalculiX

The reference of a deck is its `reference.csv`: 2 000 points of a scrambled Sobol' sequence, each a run. A
column whose name ends with /1000 holds whole thousandths of a parameter's range, at which it ran exactly.
Total indices are those of a regression on products of Legendre polynomials, of the response or of its
logarithm, which shares nothing with a Kriging screening and says itself how well it predicts left-out runs.

    python -m studies.solver_decks bracket 1 2        # seeds of two designs; needs the solver
    python -m studies.solver_decks tables 0 4         # counts over designs out of the tables; needs none
    python -m studies.solver_decks reference bracket 2000 runs.csv      # makes a reference again
"""

import csv
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

import doe
from studies.asked_range import asked_range
from workbench.sampling.plan import make_design
from workbench.screening.kriging import screen
from workbench.screening.record import Screening
from workbench.space.box import Space
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study

__all__ = ["DECKS", "Deck", "Reference", "counted", "from_table", "reference", "reference_runs", "screened"]

Array = NDArray[np.float64]
Runs = Sequence[Mapping[str, float]]
Terms = list[tuple[int, ...]]

THOUSANDTHS = "/1000"
POINTS, REFERENCE_SEED = 2000, 5
STRONGEST, HIGHEST_DEGREE = 7, 4  # inputs with products up to this degree; all others up to the square
CRUMB, STRONG = 0.01, 0.05  # of the variance


@dataclass(frozen=True, slots=True, kw_only=True)
class Deck:
    """A study of a real solver, the program it needs and where Debian has it."""

    study: Path
    program: str
    package: str

    @property
    def space(self) -> Space:
        """The parameters."""
        return load_study(self.study).space

    @property
    def responses(self) -> list[str]:
        """Their names."""
        return [response.name for response in load_study(self.study).responses]

    @property
    def runs(self) -> int:
        """Runs of a design that suit so many parameters: 4 d + 6."""
        return 4 * self.space.dimension + 6


HERE = Path(__file__).parent
DECKS = {
    "buck": Deck(study=HERE / "buck_converter/buck.toml", program="ngspice", package="ngspice"),
    "amplifier": Deck(study=HERE / "amplifier/amplifier.toml", program="ngspice", package="ngspice"),
    "bracket": Deck(study=HERE / "bracket/bracket.toml", program="ccx", package="calculix-ccx"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """Total indices of a response, scale and Q2 of the regression, by left-out runs on the response's own."""

    response: str
    totals: Mapping[str, float]
    scale: str
    q2: float

    def above(self, share: float) -> set[str]:
        """The parameters whose total index exceeds `share`."""
        return {name for name, index in self.totals.items() if index > share}


@cache
def reference_runs(name: str) -> tuple[dict[str, float], ...]:
    """The stored runs of a deck: parameters and responses by name."""
    deck = DECKS[name]
    with deck.study.with_name("reference.csv").open(newline="") as file:
        rows = [{key: float(cell) for key, cell in row.items()} for row in csv.DictReader(file)]
    space = deck.space
    if space.names[0] in rows[0]:
        return tuple(rows)
    unit = [[row[key + THOUSANDTHS] / 1000 for key in space.names] for row in rows]
    return tuple(
        {**dict(zip(space.names, map(float, values), strict=True)), **{k: row[k] for k in deck.responses}}
        for values, row in zip(space.physical(unit), rows, strict=True)
    )


@cache
def reference(name: str, response: str) -> Reference:
    """Total indices of a response of a deck by regression on its stored runs."""
    runs, space = reference_runs(name), DECKS[name].space
    unit = np.asarray(space.unit([[run[key] for key in space.names] for run in runs]))
    y = np.array([run[response] for run in runs])
    fits = [_regression(unit, y, "none")]
    if y.min() > 0:
        fits.append(_regression(unit, y, "log"))
    best = max(fits, key=lambda fit: fit.q2)
    a, b = np.split(doe.sobol(2**12, 2 * space.dimension, rng=np.random.default_rng(0)), 2, axis=1)
    at = best(a)
    totals = {}
    for i, key in enumerate(space.names):
        mixed = a.copy()
        mixed[:, i] = b[:, i]
        totals[key] = float(0.5 * ((at - best(mixed)) ** 2).mean() / at.var())
    return Reference(response=response, totals=totals, scale=best.scale, q2=best.q2)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Regression:
    """Coefficients of products of orthonormal Legendre polynomials."""

    terms: Terms
    coefficients: Array
    scale: str
    q2: float

    def __call__(self, unit: Array) -> Array:
        value = _basis(unit, self.terms) @ self.coefficients
        return np.asarray(np.exp(value) if self.scale == "log" else value)


def _basis(unit: Array, terms: Terms) -> Array:
    """(n, len(terms)): a term lists an input as often as its degree there."""
    cube = 2 * unit - 1
    powers = np.stack(
        [np.sqrt(2 * k + 1) * legendre.legval(cube, [0.0] * k + [1.0]) for k in range(HIGHEST_DEGREE + 1)]
    )
    columns = [np.prod([powers[term.count(i), :, i] for i in set(term)], axis=0) for term in terms if term]
    return np.column_stack([np.ones(len(unit)), *columns])


def _regression(unit: Array, y: Array, scale: str) -> _Regression:
    """Least squares: all products of degree 2, and those of the strongest inputs up to degree 4."""
    mapped, d = np.log(y) if scale == "log" else y, unit.shape[1]
    terms: Terms = [t for k in range(3) for t in combinations_with_replacement(range(d), k)]
    first = np.linalg.lstsq(_basis(unit, terms), mapped)[0]
    share = [sum(c**2 for c, t in zip(first, terms, strict=True) if i in t) for i in range(d)]
    strongest = sorted(int(i) for i in np.argsort(share)[-STRONGEST:])
    terms += [t for k in range(3, HIGHEST_DEGREE + 1) for t in combinations_with_replacement(strongest, k)]
    basis = _basis(unit, terms)
    q, r = np.linalg.qr(basis)
    coefficients = np.linalg.solve(r, q.T @ mapped)
    left_out = mapped - (mapped - q @ (q.T @ mapped)) / (1 - (q**2).sum(axis=1))
    predicted = np.exp(left_out) if scale == "log" else left_out
    q2 = float(1 - np.mean((y - predicted) ** 2) / y.var())
    return _Regression(terms=terms, coefficients=coefficients, scale=scale, q2=q2)


def _check_installed(deck: Deck) -> None:
    if shutil.which(deck.program) is None:
        raise SystemExit(f"{deck.program} is not installed: apt-get install {deck.package}, or another way")


def _evaluated(deck: Deck, rows: Runs) -> list[dict[str, float]]:
    """Runs of the solver, in a folder that goes away.

    Raises SystemExit where the program is not installed.
    """
    _check_installed(deck)
    with tempfile.TemporaryDirectory() as away:
        folder = shutil.copytree(deck.study.parent, Path(away, "study"))
        with Campaign.from_file(folder / deck.study.name) as campaign:
            done = campaign.evaluate(list(rows))
    return [{**run.inputs, **run.outputs} for run in done]


def screened(name: str, seed: int) -> dict[str, Screening]:
    """Screenings of every response from a fresh design of runs of the solver."""
    deck = DECKS[name]
    _check_installed(deck)
    design = make_design(deck.space, "optimised_lhs", deck.runs, seed=seed)
    runs = _evaluated(deck, design.rows())
    return {
        response.name: screen(runs, deck.space, response, seed=seed, effects=False)
        for response in load_study(deck.study).responses
    }


def from_table(name: str, response: str, seed: int, half: int) -> Screening:
    """A screening of 4 d + 6 stored runs drawn by `seed`; the halves 0 and 1 of a seed share no run."""
    deck, runs = DECKS[name], reference_runs(name)
    order = np.random.default_rng([seed, sum(map(ord, name))]).permutation(len(runs))
    chosen = order[half * deck.runs : (half + 1) * deck.runs]
    return screen([runs[i] for i in chosen], deck.space, response, effects=False)


def counted(names: Sequence[str], seeds: Sequence[int]) -> dict[str, int]:
    """Counts over two disjoint designs per response and seed, as in `studies.screening_lists`.

    `crumbs`, `missing` and `lacking` are of those called resolved, `beyond` of all.
    """
    found = dict.fromkeys(
        ("screenings", "resolved", "crumbs", "missing", "lacking", "beyond", "pairs", "agree", "strong"), 0
    )
    for name in names:
        for response in DECKS[name].responses:
            truth = reference(name, response)
            for seed in seeds:
                made = [from_table(name, response, seed, half) for half in (0, 1)]
                for screening in made:
                    listed, resolved = set(screening.selected), screening.state == "resolved"
                    weak = set(truth.totals) - truth.above(CRUMB)
                    share = float(screening.diagnosis["hidden_share"])
                    found["screenings"] += 1
                    found["resolved"] += resolved
                    found["crumbs"] += resolved and bool(listed & weak)
                    found["missing"] += resolved and not truth.above(STRONG) <= listed
                    found["lacking"] += resolved and not truth.above(CRUMB) <= listed
                    found["beyond"] += not truth.above(share) <= listed | set(screening.minor)
                    found["strong"] += truth.above(STRONG) <= listed
                if all(screening.state == "resolved" for screening in made):
                    found["pairs"] += 1
                    found["agree"] += set(made[0].selected) == set(made[1].selected)
    return found


def _make_reference(name: str, count: int, file: Path) -> None:
    """Run the solver at Sobol' points rounded to thousandths and write the table."""
    deck = DECKS[name]
    space = deck.space
    points = doe.sobol(2048, space.dimension, rng=np.random.default_rng(REFERENCE_SEED))
    unit = np.round(1000 * points)[:count].astype(int)
    done = _evaluated(deck, space.rows(unit / 1000))
    with file.open("w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow([*(key + THOUSANDTHS for key in space.names), *deck.responses])
        for row, run in zip(unit.tolist(), done, strict=True):
            table.writerow([*row, *(f"{run[key]:.5g}" for key in deck.responses)])


def _show(name: str, seeds: Sequence[int]) -> int:
    """Print the drivers of each design beside those above 1 %; returns how many above 5 % are missed."""
    designs = {seed: screened(name, seed) for seed in seeds}
    missed = 0
    for response in DECKS[name].responses:
        truth = reference(name, response)
        ranked = sorted(truth.totals.items(), key=lambda item: -item[1])
        print(f"\n{response}: total indices of {POINTS} runs ({truth.scale}, Q2 = {truth.q2:.4f})")
        print("  " + ", ".join(f"{key} {index:.3f}" for key, index in ranked if index > 0.002))
        for seed, found in designs.items():
            print(f"  seed {seed}: {found[response].verdict}")
            print(f"    {', '.join(found[response].selected)}")
            missed += len(truth.above(STRONG) - set(found[response].selected))
    print(f"\ndrivers above 5 % that a design missed: {missed}")
    return missed


def main(words: Sequence[str]) -> int:
    """See the module's docstring."""
    what = words[0] if words else ""
    if what == "tables":
        seeds = asked_range(words[1:])
        for name in DECKS:
            print(f"{name:10s} {counted([name], seeds)}", flush=True)
        return 0
    if what == "reference":
        _make_reference(words[1], int(words[2]), Path(words[3]))
        return 0
    if what not in DECKS:
        raise SystemExit(f"needs one of {', '.join(DECKS)}, tables or reference, got {what!r}")
    return int(_show(what, [int(word) for word in words[1:]] or [1, 2]) > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

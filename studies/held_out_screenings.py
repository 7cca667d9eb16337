"""What the verdict of a screening is worth on functions and decks that no rule of it was chosen on.

The thirty functions of `studies.held_out_functions`, and the stored runs of three decks of
`studies.solver_decks`, each screened on two designs as a user's study would be: `workbench.screen` as it
comes, on optimised Latin hypercubes (of a deck: of random stored runs), with noise added to the response.
Counted are

    resolved    screenings so called; of these
    crumbs      lists that hold an input with a true total index below 1 %
    missing     lists that lack one above 5 %
    pairs       both designs resolved;  agree: with the same list
    beyond      of all screenings: those that lack an input above x, the share that the verdict names
    x           its median over all screenings

    python -m studies.held_out_screenings functions 0 4     # seed 0, 4 d runs: a line per function, the sums
    python -m studies.held_out_screenings decks 0 4         # "... decks 0 4 buck": of some alone
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

import doe
from doe.latin.joint import JOINT, WEIGHTS
from studies.held_out_functions import COMPOSED, PUBLISHED, held_out
from studies.screening_lists import CRUMB, STRONG, jansen_indices
from studies.solver_decks import DECKS, reference, reference_runs
from workbench.screening.kriging import screen
from workbench.space.box import Space
from workbench.space.parameter import Parameter

__all__ = ["Counted", "Listing", "counted", "main", "of_deck", "of_function"]

NOISES = (0.0, 0.05, 0.1)  # standard deviation of the noise over that of the response
SWAPS = 40_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Listing:
    """What a screening listed, and the true total indices by name.

    apart: the inputs that stand beside the list, as below 1 %    x: the share above which none is missing
    """

    state: str
    x: float
    selected: frozenset[str]
    apart: frozenset[str]
    totals: Mapping[str, float]

    def above(self, share: float) -> set[str]:
        """The inputs that have more than `share` of the variance."""
        return {name for name, index in self.totals.items() if index > share}

    @property
    def is_resolved(self) -> bool:
        """Whether the verdict says so."""
        return self.state == "resolved"

    @property
    def has_crumb(self) -> bool:
        """Whether an input below 1 % is listed."""
        return not self.selected <= self.above(CRUMB)

    @property
    def lacks_strong(self) -> bool:
        """Whether one above 5 % is not."""
        return not self.above(STRONG) <= self.selected

    @property
    def lacks_beyond(self) -> bool:
        """Whether one above x is neither listed nor stands beside the list."""
        return not self.above(self.x) <= self.selected | self.apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Counted:
    """The counts of the module's docstring."""

    screenings: int
    resolved: int
    crumbs: int
    missing: int
    beyond: int
    pairs: int
    agree: int
    x: float

    def __str__(self) -> str:
        return (
            f"screenings {self.screenings}, resolved {self.resolved}, crumbs {self.crumbs}, missing "
            f"{self.missing}, beyond {self.beyond}, agree {self.agree} of {self.pairs}, median x "
            f"{100 * self.x:.2g} %"
        )


def counted(pairs: Sequence[tuple[Listing, Listing]]) -> Counted:
    """Counts over pairs of designs of the same study."""
    every = [one for pair in pairs for one in pair]
    resolved = [one for one in every if one.is_resolved]
    both = [(first, second) for first, second in pairs if first.is_resolved and second.is_resolved]
    return Counted(
        screenings=len(every),
        resolved=len(resolved),
        crumbs=sum(one.has_crumb for one in resolved),
        missing=sum(one.lacks_strong for one in resolved),
        beyond=sum(one.lacks_beyond for one in every),
        pairs=len(both),
        agree=sum(first.selected == second.selected for first, second in both),
        x=float(np.median([one.x for one in every])),
    )


@cache
def _totals(name: str) -> dict[str, float]:
    return dict(zip(_names(held_out(name).d), jansen_indices(held_out(name)).tolist(), strict=True))


def _names(d: int) -> list[str]:
    return [f"x{k + 1}" for k in range(d)]


def _listing(
    rows: Sequence[Mapping[str, float]], space: Space, response: str, seed: int, totals: Mapping[str, float]
) -> Listing:
    found = screen(rows, space, response, seed=seed, effects=False, regimes="off")
    return Listing(
        state=found.state,
        x=float(found.hidden_share),
        selected=frozenset(found.selected),
        apart=frozenset(found.minor),
        totals=totals,
    )


def _noisy(y: NDArray[np.float64], noise: float, rng: np.random.Generator) -> NDArray[np.float64]:
    return np.asarray(y + noise * y.std() * rng.standard_normal(len(y)))


def of_function(name: str, seed: int, noise: float, *, runs_per_input: int = 4) -> tuple[Listing, Listing]:
    """Screenings of two designs of a function, with noise of its own each."""
    f, made = held_out(name), []
    space = Space(tuple(Parameter(key, lower=0.0, upper=1.0) for key in _names(f.d)))
    for design in (0, 1):
        rng = np.random.default_rng([seed, design, sum(map(ord, name)), round(100 * noise), runs_per_input])
        points = doe.optimised_lhs(
            runs_per_input * f.d, f.d, criterion=JOINT, weights=WEIGHTS, swaps=SWAPS, rng=rng
        )
        y = _noisy(f.evaluate(points), noise, rng)
        rows = [{**row, "y": value} for row, value in zip(space.rows(points), y.tolist(), strict=True)]
        made.append(_listing(rows, space, "y", seed, _totals(name)))
    return made[0], made[1]


def of_deck(
    name: str, response: str, seed: int, noise: float, *, runs_per_input: int = 4
) -> tuple[Listing, Listing]:
    """Screenings of two sets of stored runs of a deck that share none."""
    space, runs, made = DECKS[name].space, reference_runs(name), []
    count = runs_per_input * space.dimension
    order = np.random.default_rng([seed, 7, sum(map(ord, name))]).permutation(len(runs))
    for half in (0, 1):
        rows = [runs[k] for k in order[half * count : (half + 1) * count]]
        rng = np.random.default_rng([seed, half, sum(map(ord, response)), round(100 * noise)])
        y = _noisy(np.array([row[response] for row in rows]), noise, rng)
        noisy = [{**row, response: value} for row, value in zip(rows, y.tolist(), strict=True)]
        made.append(_listing(noisy, space, response, seed, reference(name, response).totals))
    return made[0], made[1]


def _pairs(
    kind: str, names: Sequence[str], seed: int, runs_per_input: int
) -> Iterator[tuple[str, float, Listing, Listing]]:
    for name in names:
        for response in DECKS[name].responses if kind == "decks" else [""]:
            for noise in NOISES:
                if kind == "decks":
                    found = of_deck(name, response, seed, noise, runs_per_input=runs_per_input)
                else:
                    found = of_function(name, seed, noise, runs_per_input=runs_per_input)
                yield (f"{name} {response}", noise, *found)


def main(words: Sequence[str]) -> None:
    """See the module's docstring."""
    kind, seed, runs_per_input = words[0], int(words[1]), int(words[2])
    known = {"functions": (*PUBLISHED, *COMPOSED), "decks": tuple(DECKS)}
    if kind not in known:
        raise SystemExit(f"needs functions or decks, got {kind!r}")
    names = tuple(words[3:]) or known[kind]
    if stray := [name for name in names if name not in known[kind]]:
        raise SystemExit(f"{kind} are {', '.join(known[kind])}, got {stray[0]!r}")
    by_noise: dict[float, list[tuple[Listing, Listing]]] = {}
    for name, noise, first, second in _pairs(kind, names, seed, runs_per_input):
        by_noise.setdefault(noise, []).append((first, second))
        print(f"{name:20s} noise {noise:4.2f}  {_told(first)}  |  {_told(second)}", flush=True)
    for noise, pairs in by_noise.items():
        print(f"noise {noise:4.2f}: {counted(pairs)}")
    print(f"all: {counted([pair for pairs in by_noise.values() for pair in pairs])}")


def _told(one: Listing) -> str:
    """State, x, and what is wrong with a list."""
    faults = {
        "crumb": {k: one.totals[k] for k in one.selected - one.above(CRUMB)},
        "missing": {k: one.totals[k] for k in one.above(STRONG) - one.selected},
        "beyond": {k: one.totals[k] for k in one.above(one.x) - one.selected - one.apart},
    }
    told = [
        f"{fault} {', '.join(f'{k} {100 * share:.2f} %' for k, share in found.items())}"
        for fault, found in faults.items()
        if found
    ]
    listed = " ".join(sorted(one.selected))
    return f"{one.state}, x {100 * one.x:.2g} %, listed {listed} {'; '.join(told)}".rstrip()


if __name__ == "__main__":
    main(sys.argv[1:])

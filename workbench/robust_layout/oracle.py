"""The oracle of the robust loop: the worst case of a layout over the whole uncertainty, by true runs.

`look` runs the known cases and random corners: samples inside hardly ever meet a corner, and a layout that
breaks there needs no search. `search` goes on from what was seen, every combination of words (hands on,
hands off) on its own: a Kriging of all of them together follows the combination that was worst without a
layout, and misses the one that is worst with it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import NotEnoughRuns
from workbench.models.evaluator import Evaluator, Outcome
from workbench.robust_layout.cuts import distinct, spread_out_worst
from workbench.robust_layout.model import LayoutModel, layout_name
from workbench.search.arguments import Arguments
from workbench.search.worst_case import search_worst_case
from workbench.space.box import Space
from workbench.space.streams import stream
from workbench.system.atomic import read_json, write_json

__all__ = ["Found", "LayoutOracle"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

MOST_COMBINATIONS = 6  # of words that are searched one by one
CORNERS_KEPT = 10  # known runs that a search begins with, the worst ones
KEPT = 12  # of the runs, far from each other, that are told with the worst
BATCH = 4  # runs a search proposes at once, whatever the number of workers: the same numbers with 1 and 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The worst true run of a layout, and the credible excess that the search leaves open (model-based).

    others: further cases, far from it and from each other, with their values, largest first.
    """

    value: float
    case: Case
    runs: int
    status: str
    open_gap: float | None
    others: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutOracle:
    """budget: runs of each search, one for every combination of words.    corners: random corners looked at.
    tolerance: relative excess that matters to the loop.    evaluator: density -> evaluator of its true runs.
    folder: where ended searches are kept.    identity: changes when the model changes.
    """

    model: LayoutModel
    space: Space
    evaluator: Callable[[Array], Evaluator]
    folder: Path
    identity: str
    budget: int
    corners: int
    tolerance: float
    seed: int

    def look(self, density: Array, cases: Sequence[Case]) -> Found:
        """The worst of the known cases and of random corners."""
        evaluate = self.evaluator(density)
        known = [*evaluate(cases, purpose="cases"), *evaluate(self._corners(), purpose="corners")]
        (value, top), *others = self._spread(known)
        return Found(
            value=value, case=self.space.canonical(top.parameters), runs=len(known),
            status="random corners were looked at; a search was not needed", open_gap=None,
            others=[{"value": v, "case": dict(o.parameters)} for v, o in others],
        )  # fmt: skip

    def _spread(self, outcomes: Sequence[Outcome]) -> list[tuple[float, Outcome]]:
        """The worst of these runs and others far from it."""
        found = spread_out_worst(self.space, outcomes, response=self.model.response, number=KEPT)
        if not found:
            raise NotEnoughRuns("a layout gave a value in none of the cases; look at `holdfast failures`")
        return found

    def search(self, density: Array, cases: Sequence[Case]) -> Found:
        """The worst case over the whole uncertainty; the known cases count as runs made.

        Made once and kept in `folder`.
        """
        asked = (self.budget, self.corners, self.tolerance, self.seed)
        text = repr((self.identity, self.space.hash, layout_name(density), list(cases), asked))
        place = self.folder / f"search-{blake2b(text.encode(), digest_size=8).hexdigest()}.json"
        found = read_json(place)
        if found is None:
            found = self._searched(density, cases)
            place.parent.mkdir(parents=True, exist_ok=True)
            write_json(place, found)
        return Found(**found)

    def _searched(self, density: Array, cases: Sequence[Case]) -> dict[str, Any]:
        """A look at random corners, then a search for every combination of words."""
        evaluate = self.evaluator(density)
        known = [*evaluate(cases, purpose="cases"), *evaluate(self._corners(), purpose="corners")]
        worst: list[dict[str, Any]] = []
        made = [*known]
        for words in _combinations(self.space):
            here = [o for o in known if all(o.parameters[name] == word for name, word in words.items())]
            worst.append(self._in_words(evaluate, words, here, made))
        top = max(worst, key=lambda found: found["value"])
        gaps = [found["open_gap"] for found in worst if found["open_gap"] is not None]
        return {
            "value": top["value"],
            "case": top["case"],
            "runs": sum(found["runs"] for found in worst) + self.corners,
            "status": top["status"],
            "open_gap": max(gaps, default=None),
            "others": [
                {"value": v, "case": self.space.canonical(o.parameters)} for v, o in self._spread(made)[1:]
            ],
        }

    def _in_words(
        self, evaluate: Evaluator, words: Mapping[str, Any], known: Sequence[Outcome], made: list[Outcome]
    ) -> dict[str, Any]:
        """The worst case with these words fixed, from the worst known there; its runs go to `made`."""

        def read(o: Outcome) -> float:
            return o.outputs[self.model.response] if o.status == "ok" else -np.inf

        def fixed(rows: Sequence[Case], *, purpose: str) -> list[Outcome]:
            outcomes = evaluate([{**row, **words} for row in rows], purpose=purpose)
            made.extend(outcomes)
            return [replace(o, parameters=_without(o.parameters, words)) for o in outcomes]

        start = sorted(known, key=read, reverse=True)[:CORNERS_KEPT]
        found = search_worst_case(
            fixed,
            Space(tuple(p for p in self.space.parameters if p.name not in words), self.space.constraints),
            Arguments(
                response=self.model.response,
                budget=self.budget,
                seed=self.seed,
                workers=BATCH,
                tolerance=self.tolerance / 4,
                attack=0,
            ),
            start=[replace(o, parameters=_without(o.parameters, words)) for o in start],
        )
        return {
            "value": found.value,
            "case": self.space.canonical({**found.parameters, **words}),
            "runs": found.evaluations,
            "status": found.status.value,
            "open_gap": float(found.gap.width) if np.isfinite(found.gap.width) else None,
        }

    def _corners(self) -> list[dict[str, Any]]:
        """Random corners of the uncertainty; samples inside hardly ever meet one."""
        rng = stream(self.seed, "corners")
        u = rng.integers(0, 2, (self.corners, self.space.dimension)).astype(float)
        for j, parameter in enumerate(self.space.parameters):
            if not parameter.is_numeric:
                levels = parameter.unit_levels
                assert levels is not None
                u[:, j] = rng.choice(levels, len(u))
        rows = self.space.rows(u)
        return distinct([row for row in rows if self.space.violated(row) is None])


def _combinations(space: Space) -> list[dict[str, Any]]:
    """The combinations of words to search one by one; a single empty one when there are none, or too many."""
    words = [p for p in space.parameters if not p.is_numeric]
    found = [
        dict(zip((p.name for p in words), choice, strict=True))
        for choice in product(*(p.levels for p in words))
    ]
    few = len(found) <= MOST_COMBINATIONS and len(words) < len(space.parameters) and not space.constraints
    return found if few else [{}]


def _without(row: Case, names: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if name not in names}

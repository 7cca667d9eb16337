"""Every layout that a robust loop has made, and what it gives by true runs in all cases found."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.models.evaluator import Evaluator, Outcome
from workbench.robust_layout.cases import SAME, Optimised
from workbench.robust_layout.cuts import distinct
from workbench.robust_layout.model import LayoutModel, layout_name
from workbench.robust_layout.oracle import Found
from workbench.robust_layout.record import (
    FIRST_ORDER,
    excess,
    largest,
    near_the_largest,
    promise_of,
    promise_over,
)

__all__ = ["ROUNDS", "JudgedLayouts"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

JUDGED = "judged in the cases of the others alone"
ROUNDS = "rounds"  # where the layouts of the loop itself come from


@dataclass(slots=True, kw_only=True)
class JudgedLayouts:
    """Layouts by name, and the cases that judge them: a layout is as good as its worst case.

    evaluator: density -> evaluator of its true runs.
    model: which of their outputs counts, and what the value of a search is as one.
    documents: of the optimised ones, as `layout.json`.    latest: the name of the one made last.
    origins: of the optimised ones: the start that they descend from, ROUNDS for those of the loop itself.
    known: of those that `add` was called for: how many of the cases were known then, the first ones.
    continued: of a layout, the document of the last search that went on from it.
    """

    evaluator: Callable[[Array], Evaluator]
    model: LayoutModel
    cases: list[dict[str, Any]]
    layouts: dict[str, Array] = field(default_factory=dict)
    documents: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    origins: dict[str, str] = field(default_factory=dict)
    latest: str = "uniform"
    known: dict[str, int] = field(default_factory=dict)
    continued: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    _answers: dict[str, dict[str, float | None]] = field(default_factory=dict)  # of layouts, by case

    def add(self, name: str, made: Optimised, *, origin: str, after: str | None = None) -> list[str]:
        """Judge an optimised layout from now on, and its purified form where that is another and no worse.

        after: the layout that its search went on from, where it was to settle that one.
        """
        self.latest = name
        if after is not None:
            self.continued[after] = made.document
        self.layouts[name], self.documents[name] = made.density, made.document
        self.origins[name], self.known[name] = origin, len(self.cases)
        clean = made.document.get("purified")
        if not clean or not clean["accepted"] or clean["value"] > clean["before"]:
            return [name]
        if self.same_as(np.array(clean["density"]), [name]):
            return [name]
        pure = f"{name}, purified"
        self.layouts[pure], self.documents[pure] = np.array(clean["density"]), made.document
        self.origins[pure], self.known[pure] = origin, len(self.cases)
        return [name, pure]

    def leave_out(self, names: Collection[str]) -> None:
        """Judge these optimised layouts no longer."""
        for name in names:
            del self.layouts[name], self.documents[name], self.origins[name], self.known[name]
            self.continued.pop(name, None)
        if self.latest in names:
            self.latest = next(reversed(self.known))

    def of(self, origin: str, *, others: bool = False) -> list[str]:
        """The names of the optimised layouts that descend from a start, or of all others."""
        return [name for name, start in self.origins.items() if (start == origin) != others]

    def same_as(self, density: Array, names: Sequence[str]) -> str | None:
        """The first of these layouts that is this one but for rounding; None without any."""
        return next((n for n in names if np.abs(self.layouts[n] - density).max() <= SAME), None)

    def join(self, cases: Sequence[Case]) -> None:
        """Let further cases judge every layout."""
        self.cases = distinct([*self.cases, *(dict(case) for case in cases)])

    def values(self, name: str) -> list[float | None]:
        """The response of a layout in every case; None where it cannot be run."""
        density = self.layouts[name]
        known = self._answers.setdefault(layout_name(density), {})
        names = [repr(sorted(case.items())) for case in self.cases]
        missing = {key: case for key, case in zip(names, self.cases, strict=True) if key not in known}
        if missing:
            outcomes = self.evaluator(density)(list(missing.values()), purpose="cases")
            known.update(zip(missing, self.read(outcomes), strict=True))
        return [known[key] for key in names]

    def worst(self, name: str, *, first: int | None = None) -> float:
        """The largest response of a layout in any case, or in any of the first ones."""
        return largest(self.values(name)[:first])

    def worst_of(self, name: str, *, since: int = 0) -> int:
        """Which case is the worst for a layout, of those from `since` on."""
        values = [-np.inf if v is None else v for v in self.values(name)]
        return since + int(np.argmax(values[since:]))

    def beyond(self, limit: float, name: str, found: Found) -> list[Case]:
        """Those of the cases found for another layout in which this one is worse than the limit."""
        cases = [found.case, *(other["case"] for other in found.others)]
        values = self.read(self.evaluator(self.layouts[name])(cases, purpose="cases"))
        return [case for case, v in zip(cases, values, strict=True) if v is not None and v > limit]

    def best(
        self, names: Sequence[str] | None = None, *, rather: Collection[str] = (), within: float = 0.0
    ) -> str:
        """The layout, of these or of all, whose worst over the known cases is smallest; one of `rather`,
        where that is less than a share `within` above it, and no worse than any layout that nobody searched.
        """
        known = {name: self.worst(name) for name in (self.layouts if names is None else names)}
        least = min(known.values())
        enough = min(
            least + within * abs(least),
            min((worst for name, worst in known.items() if name not in self.known), default=np.inf),
        )
        return min(known, key=lambda name: (name not in rather or known[name] > enough, known[name]))

    def with_all_cases(self, worst: Mapping[str, Found]) -> dict[str, Found]:
        """Of every layout the worst true run known: what was found against it, or a case of the others."""
        found = {}
        for name in self.layouts:
            before = worst.get(name, Found(value=-np.inf, case={}, runs=0, status=JUDGED))
            known, case = self.worst(name), self.cases[self.worst_of(name)]
            found[name] = replace(before, value=known, case=case) if known > before.value else before
        return found

    def is_unsettled(self, name: str) -> bool:
        """Whether the first-order condition of a layout does not hold over all cases known by now."""
        told = self.told(name)
        if told is None:
            return False
        return not told["converged"] if told["kkt"] is None else promise_of(told) > FIRST_ORDER

    def told(self, name: str) -> dict[str, Any] | None:
        """What its search says of a layout, with the promise over all cases; None where none made it.

        Where a search that went on from it promises less, that counts, and is `went_on` with its optimum.
        """
        if name not in self.documents:
            return None
        document = dict(self.documents[name])
        kkt = self._promise(name, document)
        if name in self.continued:
            later = self.continued[name]
            left = self._promise(name, later)
            if left is not None and (kkt is None or left < kkt):
                went_on = {"value": self._optimum(later), "kkt": later["kkt"]}
                return {**document, "kkt": left, "went_on": went_on}
        return {**document, "kkt": kkt}

    def _promise(self, name: str, document: Mapping[str, Any]) -> float | None:
        """By which share of its worst a layout could fall still, by what a search says of its optimum."""
        return promise_over(document, excess(self.worst(name), self._optimum(document)))

    def _optimum(self, document: Mapping[str, Any]) -> float:
        """The response at the end of a search, over the cases known to it."""
        return self.model.as_response(float(document["value"]))

    def near(self, names: Sequence[str], *, share: float, since: int) -> list[int]:
        """Cases in which one of these layouts reaches a share of the worst of the first of them, and all
        cases from `since` on."""
        values = [self.values(name) for name in names]
        high = near_the_largest(values[0], share)
        return [
            k
            for k, pair in enumerate(zip(*values, strict=True))
            if k >= since or any(v is not None and v >= high for v in pair)
        ]

    def read(self, outcomes: Sequence[Outcome]) -> list[float | None]:
        """The response of every run, None where it gave none."""
        return [o.outputs[self.model.response] if o.status == "ok" else None for o in outcomes]

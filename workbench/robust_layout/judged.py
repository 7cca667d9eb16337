"""Every layout that a robust loop has made, and what it gives by true runs in all cases found."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.models.evaluator import Evaluator, Outcome
from workbench.robust_layout.cases import Optimised
from workbench.robust_layout.cuts import distinct
from workbench.robust_layout.model import layout_name
from workbench.robust_layout.record import largest

__all__ = ["ROUNDS", "JudgedLayouts"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

ROUNDS = "rounds"  # where the layouts of the loop itself come from


@dataclass(slots=True, kw_only=True)
class JudgedLayouts:
    """Layouts by name, and the cases that judge them: a layout is as good as its worst case.

    evaluator: density -> evaluator of its true runs.    response: which of their outputs counts.
    documents: of the optimised ones, as `layout.json`.    latest: the name of the one made last.
    origins: of the optimised ones: the start that they descend from, ROUNDS for those of the loop itself.
    """

    evaluator: Callable[[Array], Evaluator]
    response: str
    cases: list[dict[str, Any]]
    layouts: dict[str, Array] = field(default_factory=dict)
    documents: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    origins: dict[str, str] = field(default_factory=dict)
    latest: str = "uniform"
    _answers: dict[str, dict[str, float | None]] = field(default_factory=dict)  # of layouts, by case

    def add(self, name: str, made: Optimised, *, origin: str) -> list[str]:
        """Judge an optimised layout from now on, and its purified form where that is no worse."""
        self.latest = name
        self.layouts[name], self.documents[name] = made.density, made.document
        self.origins[name] = origin
        clean = made.document.get("purified")
        if not clean or not clean["accepted"] or clean["value"] > clean["before"]:
            return [name]
        pure = f"{name}, purified"
        self.layouts[pure], self.documents[pure] = np.array(clean["density"]), made.document
        self.origins[pure] = origin
        return [name, pure]

    def of(self, origin: str, *, others: bool = False) -> list[str]:
        """The names of the optimised layouts that descend from a start, or of all others."""
        return [name for name, start in self.origins.items() if (start == origin) != others]

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

    def worst(self, name: str) -> float:
        """The largest response of a layout in any case."""
        return largest(self.values(name))

    def best(self, names: Sequence[str] | None = None) -> str:
        """The layout, of these or of all, whose worst over the known cases is smallest."""
        known = {name: self.worst(name) for name in (self.layouts if names is None else names)}
        return min(known, key=lambda name: known[name])

    def read(self, outcomes: Sequence[Outcome]) -> list[float | None]:
        """The response of every run, None where it gave none."""
        return [o.outputs[self.response] if o.status == "ok" else None for o in outcomes]

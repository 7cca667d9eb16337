"""What a search stated about the remaining gap while it ran: one look per number of runs."""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from workbench.search.evidence.gap import Gap
from workbench.search.runs.ledger import Ledger

__all__ = ["GapHistory", "GapLook"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GapLook:
    """The gap after `runs` runs with an answer, given ones included, of which the search made `iteration`.

    `upper` in the response's unit and sign; `share`: of the range of the values seen until then, None when
    all were equal. A look that is not `full` is the quick one of
    `workbench.search.evidence.gap.modelled_gap`, which leaves the rough model out and may state less than
    the full one.
    """

    runs: int
    iteration: int
    upper: float
    width: float
    share: float | None
    kind: str
    full: bool

    def to_dict(self) -> dict[str, Any]:
        """For the JSON document."""
        return asdict(self)


@dataclass(slots=True)
class GapHistory:
    """The looks of one search, in the order of the runs."""

    looks: list[GapLook] = field(default_factory=list)

    def note(self, gap: Gap, ledger: Ledger, *, full: bool) -> None:
        """Put a gap stated after the runs of `ledger` on record; one that knows no bound is left out.

        Of two looks after the same runs the later counts: it is the fuller one.
        """
        if not np.isfinite(gap.upper):
            return
        spread, runs = float(np.ptp(ledger.v)), len(ledger.runs)
        look = GapLook(
            runs=runs,
            iteration=ledger.spent,
            upper=ledger.sign * gap.upper,
            width=gap.width,
            share=gap.width / spread if spread > 0 else None,
            kind=gap.kind,
            full=full,
        )
        if self.looks and self.looks[-1].runs == runs:
            self.looks.pop()
        self.looks.append(look)

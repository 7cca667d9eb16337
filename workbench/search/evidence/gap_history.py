"""What a search stated about the remaining gap while it ran: one look per number of runs."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from workbench.search.evidence.gap import Gap

__all__ = ["GapLook", "gap_look", "with_look"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GapLook:
    """The gap after `runs` runs with an answer, given ones included, of which the search made `iteration`.

    `upper` in the response's unit and sign; `share`: of the range of the values seen until then, None when
    all were equal. A look that is not `full` is the quick one of
    `workbench.search.evidence.gap.remaining_gap`, which leaves the rough model out and may state less than
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


def gap_look(gap: Gap, *, v: np.ndarray, sign: float, runs: int, iteration: int, full: bool) -> GapLook:
    """The look at a gap of the signed values v (n,)."""
    spread = float(np.ptp(v))
    return GapLook(
        runs=runs,
        iteration=iteration,
        upper=sign * gap.upper,
        width=gap.width,
        share=gap.width / spread if spread > 0 else None,
        kind=gap.kind,
        full=full,
    )


def with_look(looks: Sequence[GapLook], look: GapLook) -> list[GapLook]:
    """The looks with a further one; of two after the same runs the later counts: it is the fuller one."""
    kept = looks[:-1] if looks and looks[-1].runs == look.runs else looks
    return [*kept, look]

"""What breaks a layout is run again at half the step, where the model can, before it is believed.

A case whose run is beyond the limit at its own step and not at half of it says something about the step. An
attack that ended there would have spent a part of its budget on a layout that it did not break.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from workbench.models.evaluator import Evaluator, Outcome

__all__ = ["Believing"]

Case = Mapping[str, Any]


@dataclass(slots=True, kw_only=True)
class Believing:
    """An evaluator that answers with the value at half the step where that alone is within the limit.

    When a case is believed the layout is broken, and further ones are answered as they are, until `believes`
    is asked about them.

    finer: the response at half the step, None where there is none.    disbelieved: cases with both values.
    """

    evaluate: Evaluator
    response: str
    limit: float
    finer: Callable[[Case], float | None]
    is_broken: bool = False
    _doubtful: dict[str, dict[str, Any] | None] = field(default_factory=dict)  # None: believed

    def __call__(self, rows: Sequence[Case], *, purpose: str) -> list[Outcome]:
        """One outcome per row."""
        return [self._answer(outcome) for outcome in self.evaluate(rows, purpose=purpose)]

    @property
    def disbelieved(self) -> list[dict[str, Any]]:
        """Every case beyond the limit that is not beyond it at half the step."""
        return [found for found in self._doubtful.values() if found is not None]

    def believes(self, outcome: Outcome) -> bool:
        """Whether a run is within the limit, or beyond it at half the step, too; asked once of each."""
        name = repr(sorted(outcome.parameters.items()))
        if name not in self._doubtful:
            if outcome.status != "ok" or outcome.outputs[self.response] <= self.limit:
                return True
            value, again = outcome.outputs[self.response], self.finer(outcome.parameters)
            is_doubtful = again is not None and again <= self.limit
            self._doubtful[name] = (
                {"value": value, "at half the step": again, "case": dict(outcome.parameters)}
                if is_doubtful
                else None
            )
        return self._doubtful[name] is None

    def _answer(self, outcome: Outcome) -> Outcome:
        if self.is_broken or outcome.status != "ok" or outcome.outputs[self.response] <= self.limit:
            return outcome
        if self.believes(outcome):
            self.is_broken = True
            return outcome
        found = self._doubtful[repr(sorted(outcome.parameters.items()))]
        assert found is not None
        return replace(outcome, outputs={**outcome.outputs, self.response: found["at half the step"]})

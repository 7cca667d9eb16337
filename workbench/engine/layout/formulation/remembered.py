"""The last evaluation of a design, kept: who asks again at the same design pays nothing."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .problem import Evaluation

__all__ = ["remembering"]

Array = NDArray[np.float64]


def remembering(evaluate: Callable[[Array], Evaluation]) -> Callable[[Array], Evaluation]:
    """Keep the last evaluation, so that asking again at the same density costs nothing.

    An objective that can be evaluated in some of its scenarios, or over a part of its time, stays one.
    """
    if hasattr(evaluate, "until"):
        return _OfRuns(evaluate)
    return _OfScenarios(evaluate) if hasattr(evaluate, "of_scenarios") else _Remembered(evaluate)


class _Remembered:
    """An objective and its last evaluation."""

    def __init__(self, evaluate: Any) -> None:
        self._evaluate = evaluate
        self._kept: tuple[bytes, Evaluation] | None = None

    def __call__(self, density: Array) -> Evaluation:
        key = np.ascontiguousarray(density).tobytes()
        if self._kept is None or self._kept[0] != key:
            self._kept = key, self._evaluate(density)
        return self._kept[1]


class _OfScenarios(_Remembered):
    """The same, of one whose scenarios can be evaluated apart."""

    def of_scenarios(self, chosen: Sequence[int]) -> Callable[[Array], Evaluation]:
        """The objective of these scenarios alone."""
        return remembering(self._evaluate.of_scenarios(chosen))


class _OfRuns(_OfScenarios):
    """The same, of one whose runs can be cut short."""

    def until(self, share: float) -> Callable[[Array], Evaluation] | None:
        """The objective over the first share of every run, or None where its window begins later."""
        shorter = self._evaluate.until(share)
        return None if shorter is None else remembering(shorter)

"""Starts from windows that grow: the layout of a short window, taken on to the next longer one.

On a short window few peaks compete and there are few local optima; which peaks are traded on the whole window
is decided late. A chain begins at the even layout with a fifth of the time and takes a few steps at every
length, so that it follows an optimum while peaks come in one by one: a continuation (Allgower and Georg
1990) in the length of the window. Chains that grow at another pace branch off elsewhere, and give other
starts. A run over a share of the window costs that share.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import Recorder
from .probing import spread

__all__ = ["CHAINS", "Chain", "InTime", "LocalSearch", "grown_start"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """How a window grows: from a first share of it, by a share at a time, evaluations at every length."""

    first: float
    by: float
    evaluations: int

    @property
    def shares(self) -> Array:
        """Of the window, all but the whole of it.

        >>> Chain(first=0.5, by=0.2, evaluations=3).shares.round(3)
        array([0.5, 0.7, 0.9])
        """
        return np.arange(self.first, 1.0 - 1e-3 * self.by, self.by)

    @property
    def cost(self) -> int:
        """Evaluations at most, those over a share of the window counted by that share."""
        return int(np.ceil(self.evaluations * self.shares.sum()))


CHAINS = (
    Chain(first=0.2, by=0.1, evaluations=6),
    Chain(first=0.2, by=0.05, evaluations=3),
    Chain(first=0.15, by=0.07, evaluations=4),
)


@runtime_checkable
class InTime(Protocol):
    """An objective whose runs can be cut short."""

    def __call__(self, density: Array) -> Evaluation:
        """All of its time."""
        ...

    def until(self, share: float) -> Callable[[Array], Evaluation] | None:
        """The objective over the first share of every run, or None where its window begins later."""
        ...


class LocalSearch(Protocol):
    """Steps of a local search on a problem from a density, and a recorder of its own that counts them."""

    def __call__(
        self, problem: LayoutProblem, density: Array, *, evaluations: int, recorder: Recorder
    ) -> Array:
        """The density where it stopped."""
        ...


def grown_start(
    problem: LayoutProblem, recorder: Recorder, chain: Chain, search: LocalSearch, *, max_evaluations: int
) -> Array | None:
    """Where a chain arrives before the whole window, or None where it cannot go or evaluations run out.

    max_evaluations: of the recorder, evaluations over a share of the window counted by that share.
    """
    assert isinstance(problem.evaluate, InTime)
    density, grown = spread(problem), False
    for share in chain.shares:
        shorter = problem.evaluate.until(float(share))
        if shorter is None:
            continue
        if recorder.evaluations >= max_evaluations:
            return None
        part = replace(problem, evaluate=shorter, times=None)
        own = Recorder(part)
        density = search(part, density, evaluations=chain.evaluations, recorder=own)
        recorder.beside += float(share) * own.evaluations
        recorder.probes += int(np.ceil(share * own.probes))
        grown = True
    return density if grown else None

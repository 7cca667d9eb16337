"""Whose turn it is: the proposals of a search in order, as long as runs gain, after a stall, and at the end.

As long as runs gain, expected improvement and upper confidence bound take turns. A turn that promises no
noticeable gain goes to the next peak, else to the cautious model, else to an exploration; after a stall the
turns are shared out among all proposals. The names are those that the runs are recorded with, `hill` for the
next peak.
"""

from dataclasses import dataclass

from workbench.search.runs.unit_space import SearchSpace

__all__ = ["Turn", "turns_of"]

GAINING = ("ei", "ucb")
STALLED = (
    "hill", "hill", "explore", "hill", "hill", "ei", "hill", "hill", "cautious", "hill", "trust", "flip",
)  # fmt: skip
FINISHING = ("predicted", "predicted", "trust")
ELSEWHERE = ("hill", "cautious", "explore")  # what takes a turn that holds no gain, the first that may


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """`number` of the turn; `stalled`: nothing gained for long; `finishing`: the last runs of the budget,
    which refine the worst run.
    """

    number: int
    stalled: bool = False
    finishing: bool = False


def turns_of(where: SearchSpace, turn: Turn) -> tuple[list[str], tuple[str, ...]]:
    """The proposals that take turns, and those that take a turn without promise."""
    turns = list(FINISHING if turn.finishing else STALLED if turn.stalled else GAINING)
    elsewhere: tuple[str, ...] = () if turn.finishing else ELSEWHERE
    if where.combinations() is not None and not where.is_finite and not turn.finishing:
        for at in range(len(turns) // 2, 0, -1):
            turns.insert(2 * at, "combination")
        elsewhere = ("combination", *ELSEWHERE) if turn.number % 3 == 0 else ELSEWHERE
    return turns, elsewhere

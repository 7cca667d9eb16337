"""How a run ended, and the numbers to judge it by."""

from dataclasses import dataclass
from enum import Enum

__all__ = ["Diagnosis", "Status"]


class Status(Enum):
    """How a run ended; every member is a sentence."""

    COMPLETE = "The run reached its end time."


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """Numbers to judge a run by.

    notices: what the user should know, a sentence each, logged as well.  halved: where the steps end that did
    not converge and were made in parts, s.
    """

    newton_iterations: int
    factorisations: int
    redundant_rows: tuple[str, ...]
    reason: str
    notices: tuple[str, ...] = ()
    halved: tuple[float, ...] = ()

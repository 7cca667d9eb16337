"""What a search is asked for, checked before the first run is made."""

from dataclasses import dataclass
from math import isfinite
from numbers import Integral, Real
from typing import Any

from surrogates.analysis.search_scale import SEARCH_SCALES
from workbench.errors import StudyError
from workbench.models.evaluator import Reading
from workbench.models.readings import Within, refuse_own_limit
from workbench.search.evidence.enclosure import Enclosure

__all__ = ["AMONG_NOISE", "Arguments", "default_budget"]

RUNS, AMONG_NOISE = 60, 120  # with as many the gap of a mean is a tenth of the range


def default_budget(noise: bool | None) -> int:
    """The true runs of a search that nobody gave a budget; a declared noise has to be averaged out."""
    return AMONG_NOISE if noise else RUNS


@dataclass(frozen=True, slots=True, kw_only=True)
class Arguments:
    """What `workbench.search.worst_case.worst_case` is asked for, under the names that it explains.

    Raises:
        StudyError: for the first argument that no search can use.

    >>> Arguments(budget=10.5)
    Traceback (most recent call last):
    workbench.errors.StudyError: budget needs a whole number of runs >= 0, got 10.5
    """

    response: str | Reading | None = None
    sense: str = "max"
    budget: int = RUNS
    seed: int = 0
    workers: int = 1
    tolerance: float = 1e-3
    lipschitz: float | None = None
    enclosure: Enclosure | None = None
    attack: int | None = None
    noise: bool | None = None
    failures: str = "avoid"
    transform: str = "auto"
    given_are_even: bool = True  # whether given runs fill the space, as a design does and another search not

    def __post_init__(self) -> None:
        if self.sense not in ("max", "min"):
            raise StudyError(f"sense needs 'max' or 'min', got {self.sense!r}")
        if isinstance(self.response, Within):
            refuse_own_limit(self.response.response, self.response.limits, self.sense)
        for name, value, least, what in (
            ("budget", self.budget, 0, "a whole number of runs"),
            ("seed", self.seed, 0, "a whole number"),
            ("workers", self.workers, 1, "a whole number of runs at a time"),
        ):
            if not _is_whole(value) or value < least:
                raise StudyError(f"{name} needs {what} >= {least}, got {value!r}")
        if self.attack is not None and (not _is_whole(self.attack) or self.attack < 0):
            raise StudyError(
                f"attack needs a whole number of runs >= 0, or None for what the search leaves of its "
                f"budget, got {self.attack!r}"
            )
        if self.transform not in SEARCH_SCALES:
            why = "; ranks tell nothing beyond the runs" if self.transform == "ranks" else ""
            raise StudyError(
                f"transform needs one of {', '.join(SEARCH_SCALES)}, got {self.transform!r}{why}"
            )
        if self.noise and self.transform not in ("auto", "none"):
            raise StudyError(
                f"transform={self.transform!r} does not go with noise=True: the mean is searched, which is "
                "that of the response itself. Leave one out"
            )
        if self.failures not in ("avoid", "worst"):
            raise StudyError(f"failures needs 'avoid' or 'worst', got {self.failures!r}")
        if self.noise is not None and not isinstance(self.noise, bool):
            raise StudyError(
                f"noise needs True, False, or None to find it out by the runs, got {self.noise!r}"
            )
        if self.noise and self.failures == "worst":
            raise StudyError(
                "failures='worst' does not go with noise=True: a mean of runs that may fail is none. "
                "Leave one out"
            )
        without = [n for n in ("lipschitz", "enclosure", "attack") if getattr(self, n)]
        if self.noise and without:
            raise StudyError(
                f"noise=True does not go with {without[0]}, which takes every run for exact. Leave one out"
            )
        if not _is_number(self.tolerance):
            raise StudyError(
                f"tolerance needs a number, a share of the spread of the values, got {self.tolerance!r}"
            )
        lipschitz, enclosure = self.lipschitz, self.enclosure
        if lipschitz is not None and not (_is_number(lipschitz) and lipschitz > 0):
            raise StudyError(f"lipschitz needs a constant > 0 per unit of the cube, got {lipschitz!r}")
        if enclosure is not None and not isinstance(enclosure, Enclosure):
            raise StudyError(
                f"enclosure needs an Enclosure, got {enclosure!r:.100}. "
                "Write enclosure=Enclosure(function, calls=2000), from workbench.enclosure"
            )


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)

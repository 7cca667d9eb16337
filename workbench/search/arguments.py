"""What the arguments of a search need to be, checked before the first run is made."""

from math import isfinite
from numbers import Integral, Real
from typing import Any

from workbench.errors import StudyError
from workbench.search.evidence.enclosure import Enclosure

__all__ = ["check_search_arguments"]


def check_search_arguments(
    *,
    sense: Any,
    budget: Any,
    seed: Any,
    workers: Any,
    tolerance: Any,
    lipschitz: Any = None,
    enclosure: Any = None,
) -> None:
    """Raise StudyError for the first argument that no search can use.

    >>> check_search_arguments(sense="max", budget=10.5, seed=0, workers=1, tolerance=1e-3)
    Traceback (most recent call last):
    workbench.errors.StudyError: budget needs a whole number of runs >= 0, got 10.5
    """
    if sense not in ("max", "min"):
        raise StudyError(f"sense needs 'max' or 'min', got {sense!r}")
    for name, value, least, what in (
        ("budget", budget, 0, "a whole number of runs"),
        ("seed", seed, 0, "a whole number"),
        ("workers", workers, 1, "a whole number of runs at a time"),
    ):
        if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
            raise StudyError(f"{name} needs {what} >= {least}, got {value!r}")
    if not _is_number(tolerance):
        raise StudyError(f"tolerance needs a number, a share of the spread of the values, got {tolerance!r}")
    if lipschitz is not None and not (_is_number(lipschitz) and lipschitz > 0):
        raise StudyError(f"lipschitz needs a constant > 0 per unit of the cube, got {lipschitz!r}")
    if enclosure is not None and not isinstance(enclosure, Enclosure):
        raise StudyError(
            f"enclosure needs an Enclosure, got {enclosure!r:.100}. "
            "Write enclosure=Enclosure(function, calls=2000), from workbench.enclosure"
        )


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)

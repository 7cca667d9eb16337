"""The exceptions a user may catch, as a tree.

    HoldfastError
    ├── StudyError            the study file or an argument of a verb is not usable (exit code 2)
    ├── EvaluationFailed      a model run gave no usable response
    ├── StoreError            the campaign's folder or database cannot be read or written (exit code 5)
    ├── Contradiction         what was about to be written contradicts itself or a known run
    ├── Interrupted           stopped by the user; run again to continue (exit code 4)
    └── NotEnoughRuns         fewer usable runs than a method needs (exit code 2)

The packages below the workbench raise their own (`surrogates.NotPositiveDefinite`, `engine.NotConverged`).
"""

__all__ = [
    "Contradiction",
    "EvaluationFailed",
    "HoldfastError",
    "Interrupted",
    "NotEnoughRuns",
    "StoreError",
    "StudyError",
]


class HoldfastError(Exception):
    """Base of every error that holdfast raises on purpose."""

    exit_code = 1


class StudyError(HoldfastError, ValueError):
    """The study file, a table or an argument is not usable; the message says where and what to do."""

    exit_code = 2


class NotEnoughRuns(StudyError):
    """Fewer usable runs than the method needs."""


class EvaluationFailed(HoldfastError):
    """A model run gave no usable response."""

    exit_code = 3


class Interrupted(HoldfastError):
    """The user stopped the campaign; running again continues it."""

    exit_code = 4


class StoreError(HoldfastError, OSError):
    """The campaign's folder or database cannot be read or written."""

    exit_code = 5


class Contradiction(HoldfastError):
    """What was about to be written contradicts itself or a known run; nothing was written."""

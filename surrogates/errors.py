"""Errors of the surrogates that a user may catch."""

from numpy.linalg import LinAlgError

__all__ = ["NotPositiveDefinite", "TooFewRuns"]


class NotPositiveDefinite(LinAlgError, ValueError):
    """The correlation matrix has no Cholesky factor; the message names the closest pair of runs."""


class TooFewRuns(ValueError):
    """Fewer runs than the trend has terms, or only one run."""

"""Kriging with nothing left to the runs: Gaussian, constant trend, plug-in intervals, or as said."""

from typing import Any

from surrogates import Kriging

__all__ = ["plain"]


def plain(**settings: Any) -> Kriging:
    """The model whose parts tests check one by one."""
    return Kriging(**{"correlation": "gaussian", "trend": "constant", "intervals": "plug-in"} | settings)

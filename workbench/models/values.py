"""What a number must be to stand as a response: finite, and no larger than a model of it can hold.

An integration that diverges leaves infinity, or stops short of it at 1e293: to whoever reads the response
both say the same. Variances are squares, and the square of a number beyond 1e154 is infinite.
"""

from collections.abc import Mapping
from math import isfinite

__all__ = ["LARGEST", "is_value", "why_no_values"]

LARGEST = 1e140  # below the 1e150 of the Kriging: the scales of a search stretch what they are given


def is_value(number: float) -> bool:
    """Whether a response may be this number.

    >>> is_value(-1e139), is_value(6e293), is_value(float("nan"))
    (True, False, False)
    """
    return abs(number) <= LARGEST


def why_no_values(outputs: Mapping[str, float]) -> str:
    """What is wrong with the responses of a run in words; "" where nothing is.

    >>> why_no_values({"y": float("inf"), "z": 1.0}), why_no_values({"z": 1.0})
    ('not a finite number: y = inf', '')
    >>> print(why_no_values({"y": -6e293}))
    too large a number: y = -6e+293 lies beyond 1e+140, as where an integration diverges
    """
    endless = [f"{name} = {value}" for name, value in outputs.items() if not isfinite(value)]
    if endless:
        return f"not a finite number: {', '.join(endless)}"
    large = [f"{name} = {value:.6g}" for name, value in outputs.items() if not is_value(value)]
    if not large:
        return ""
    return (
        f"too large a number: {', '.join(large)} {'lies' if len(large) == 1 else 'lie'} beyond "
        f"{LARGEST:.0e}, as where an integration diverges"
    )

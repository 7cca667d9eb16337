"""Numbers, counts and units as they are read: few digits, exponents raised. Files keep the plain spelling."""

import math
import re
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

__all__ = ["DIGITS", "counted", "digits_apart", "number", "raised", "significant", "told_apart"]

DIGITS = 6  # significant, where nothing else is said
ALL_DIGITS = 17  # a float has no more
SAME, ALIKE = 1e-14, 1e-6  # of the largest value, of the range: what is no further apart is told alike

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def raised(unit: str) -> str:
    """A unit with its exponents raised.

    >>> raised("kg m^2/s^3"), raised("1/s^-10")
    ('kg m²/s³', '1/s⁻¹⁰')
    """
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(RAISED), unit)


def number(value: Any, digits: int = DIGITS) -> str:
    """A value as it is read: `digits` significant digits, no exponent between 1e-4 and 1e7.

    >>> [number(v) for v in (115600.0, 0.123456789, 13.3125, 2e-9, 64, None, True, "x1", -0.5)]
    ['115600', '0.123457', '13.3125', '2e-09', '64', '–', 'yes', 'x1', '-0.5']
    """
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int) or not isinstance(value, float):
        return str(value)
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if not -4 <= exponent < 7:
        return f"{value:.{digits - 1}g}"
    text = f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def significant(value: float, digits: int = DIGITS) -> str:
    """A value with so many significant digits, in the way of `format`."""
    return f"{value:.{digits}g}"


def digits_apart(
    values: Iterable[float | None],
    *,
    least: int = DIGITS,
    show: Callable[[float, int], str] = significant,
) -> int:
    """How many digits tell values apart that are shown beside one another; `least` where so many do.

    Where more are needed one is added, so that their difference has a digit that is not rounded. Values that
    differ by rounding or by a millionth of the range of all, None and what is not finite ask for nothing.

    >>> digits_apart([2.95, 3.358586]), digits_apart([999999999.046, 999999999.489])
    (6, 11)
    >>> digits_apart([0.0, 0.489871234, 0.489871236]), digits_apart([0.3, 0.1 + 0.2])
    (6, 6)
    """
    told = sorted({float(value) for value in values if value is not None and math.isfinite(value)})
    if not told:
        return least
    near = max(SAME * max(map(abs, told)), ALIKE * (told[-1] - told[0]))
    apart = [(a, b) for a, b in pairwise(told) if b - a > near]
    for digits in range(least, ALL_DIGITS):
        if all(show(a, digits) != show(b, digits) for a, b in apart):
            return digits if digits == least else digits + 1
    return ALL_DIGITS


def told_apart(*values: float, least: int = DIGITS) -> list[str]:
    """Values that a sentence puts beside one another, with as many digits as tell them apart.

    >>> told_apart(-1e6, -999999.9, -1000000.3)
    ['-1000000', '-999999.9', '-1000000.3']
    """
    digits = digits_apart(values, least=least)
    return [significant(value, digits) for value in values]


def counted(count: int, one: str, many: str | None = None) -> str:
    """So many of something: `one` or `many` of it, the words that follow the count; an s makes the plural.

    >>> counted(1, "run"), counted(0, "run"), counted(2, "run is", "runs are")
    ('1 run', '0 runs', '2 runs are')
    """
    return f"{count} {one if count == 1 else many or one + 's'}"

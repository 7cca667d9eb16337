"""Numbers and units as they are read: few digits, exponents raised. Files keep the plain spelling."""

import math
import re
from typing import Any

__all__ = ["DIGITS", "number", "raised"]

DIGITS = 6  # significant, where nothing else is said

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

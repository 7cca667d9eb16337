"""Units as they are read: exponents raised. Files keep the plain spelling."""

import re

__all__ = ["raised"]

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def raised(unit: str) -> str:
    """A unit with its exponents raised.

    >>> raised("kg m^2/s^3"), raised("1/s^-10")
    ('kg m²/s³', '1/s⁻¹⁰')
    """
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(RAISED), unit)

"""What a number must be to stand as a response: finite, and no larger than a model of it can hold.

An integration that diverges leaves infinity, or stops short of it at 1e293: to whoever reads the response
both say the same. Variances are squares, and the square of a number beyond 1e154 is infinite.
"""

import re
from collections.abc import Mapping, Sequence
from math import isfinite

__all__ = ["LARGEST", "is_value", "number_in", "other_separator", "what_is_wrong", "why_no_values"]

FORTRAN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)[dD][+-]?\d+")
WITH_UNIT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?)\s*([^\W\d_].*|%|°.*)")
LARGEST = 1e140  # below the 1e150 of the Kriging: the scales of a search stretch what they are given


def is_value(number: float) -> bool:
    """Whether a response may be this number.

    >>> is_value(-1e139), is_value(6e293), is_value(float("nan"))
    (True, False, False)
    """
    return abs(number) <= LARGEST


def number_in(cell: str) -> float:
    """The number that a text is, the exponent of Fortran's double precision among them; else a ValueError.

    Digits in groups, "1_000", are a number to Python alone.

    >>> number_in("1.5D+00"), number_in(" 2e3 ")
    (1.5, 2000.0)
    """
    text = cell.strip()
    if "_" in text:
        raise ValueError(f"{text!r} is no number")
    return float(re.sub("[dD]", "e", text) if FORTRAN.fullmatch(text) else text)


def other_separator(header: Sequence[str]) -> str:
    r"""What parts the columns of a CSV whose first line came out as one cell; "" where nothing is like it.

    >>> other_separator(["load;gap"]), other_separator(["load", "gap"]), other_separator(["load"])
    (';', '', '')
    """
    return next((sign for sign in ";\t|" if sign in header[0]), "") if len(header) == 1 else ""


def what_is_wrong(cell: str) -> str:
    """Why a text that a person takes for a number is none, and what to write; "" for other texts.

    >>> print(what_is_wrong("3.5 MPa"))
    Write the number alone, 3.5; the unit 'MPa' belongs to the name of the column or into the study
    >>> what_is_wrong("1,234.5"), what_is_wrong("diverged")
    ('Write it without commas and with a decimal point, such as 1234.5', '')
    """
    found = WITH_UNIT.fullmatch(cell)
    if found is not None:
        return (
            f"Write the number alone, {found[1]}; the unit {found[2]!r} belongs to the name of the column or "
            "into the study"
        )
    if "," in cell and cell.count(".") < 2:
        whole = cell.replace(",", "") if "." in cell or cell.count(",") > 1 else cell.replace(",", ".")
        try:
            float(whole)
        except ValueError:
            return ""
        return f"Write it without commas and with a decimal point, such as {whole}"
    return ""


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

"""Welch's 20-dimensional screening benchmark (dissertation, eq. 3.14; Welch et al. 1992, Technometrics 34).

Six of the twenty inputs matter on the cube [-1/2, 1/2]^20: x1 (only through its interaction with x12), x4,
x5, x12, x19 and x20. Two (x8 and x16) do not occur at all, the other twelve are of the order of a percent of
the standard deviation. Public copies of the function differ in the sign of the linear x19 term; here it is
minus, as printed, and `tests/papers/surrogates/test_welch20.py` checks the variances that only this sign
gives.
"""

from collections.abc import Mapping

__all__ = ["MAXIMUM", "NAMES", "welch20", "worst_corner"]

NAMES = tuple(f"x{i}" for i in range(1, 21))

# 5 + 5 + 1/2 + 5/2 + 1/4 + 1/16: the six terms of (3.14) at their worst, one after the other
MAXIMUM = 13.3125

# the terms that are linear and small: name -> coefficient
SMALL: Mapping[str, float] = {
    "x2": 0.05,
    "x3": 0.08,
    "x6": -0.03,
    "x7": 0.03,
    "x9": -0.09,
    "x10": -0.01,
    "x11": -0.07,
    "x14": -0.04,
    "x15": 0.06,
    "x17": -0.01,
    "x18": -0.03,
}


def welch20(**x: float) -> float:
    """Value of eq. (3.14) for the twenty named inputs x1 .. x20, dimensionless.

        f = 5 x12 / (1 + x1) + 5 (x4 - x20)^2 + x5 + 40 x19^3 - 5 x19 + 0.25 x13^2 + small linear terms

    Raises TypeError when a name is missing or unknown.

    >>> welch20(**dict.fromkeys(NAMES, 0.0))
    0.0
    >>> round(welch20(**worst_corner()), 10) == MAXIMUM
    True
    """
    if x.keys() != set(NAMES):
        missing = [name for name in NAMES if name not in x]
        unknown = sorted(x.keys() - set(NAMES))
        raise TypeError(f"welch20 takes x1 .. x20 by name; missing: {missing}, unknown: {unknown}")
    strong = (
        5.0 * x["x12"] / (1.0 + x["x1"])
        + 5.0 * (x["x4"] - x["x20"]) ** 2
        + x["x5"]
        + 40.0 * x["x19"] ** 3
        - 5.0 * x["x19"]
    )
    return strong + 0.25 * x["x13"] ** 2 + sum(coefficient * x[name] for name, coefficient in SMALL.items())


def worst_corner() -> dict[str, float]:
    """One of the corners of [-1/2, 1/2]^20 where (3.14) is largest; x4 = -x20 and x13 have two signs each."""
    corner = dict.fromkeys(NAMES, 0.5)
    corner |= {"x1": -0.5, "x20": -0.5}
    corner |= {name: 0.5 if coefficient > 0 else -0.5 for name, coefficient in SMALL.items()}
    return corner

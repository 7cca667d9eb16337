"""What a unit measures and how large it is, where that is known: to tell kg from g in the header of a table.

A unit is a product of symbols with powers, `kg m/s^2`, each a base symbol behind a prefix perhaps. It is
known by its dimension, powers of m, kg, s, A, K, mol, and its size in these. An angle has no dimension, so
that N m/rad is N m, and a turn may be told as 1: sizes 2 pi apart are no contradiction, as rpm and 1/min are
none. Nothing is converted by it.
"""

import re

__all__ = ["contradiction", "scale_of", "unit_in_header", "without_unit"]

Scale = tuple[tuple[int, ...], float]

PREFIXES = {
    "": 1.0, "p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1,
    "da": 1e1, "h": 1e2, "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12,
}  # fmt: skip
PI = 3.141592653589793
BASES = 6
# symbol: powers of m, kg, s, A, K, mol; size
PREFIXED: dict[str, Scale] = {
    "m": ((1, 0, 0, 0, 0, 0), 1.0),
    "g": ((0, 1, 0, 0, 0, 0), 1e-3),
    "s": ((0, 0, 1, 0, 0, 0), 1.0),
    "A": ((0, 0, 0, 1, 0, 0), 1.0),
    "K": ((0, 0, 0, 0, 1, 0), 1.0),
    "mol": ((0, 0, 0, 0, 0, 1), 1.0),
    "rad": ((0, 0, 0, 0, 0, 0), 1.0),
    "N": ((1, 1, -2, 0, 0, 0), 1.0),
    "Pa": ((-1, 1, -2, 0, 0, 0), 1.0),
    "bar": ((-1, 1, -2, 0, 0, 0), 1e5),
    "J": ((2, 1, -2, 0, 0, 0), 1.0),
    "W": ((2, 1, -3, 0, 0, 0), 1.0),
    "V": ((2, 1, -3, -1, 0, 0), 1.0),
    "Hz": ((0, 0, -1, 0, 0, 0), 1.0),
    "F": ((-2, -1, 4, 2, 0, 0), 1.0),
    "H": ((2, 1, -2, -2, 0, 0), 1.0),
    "C": ((0, 0, 1, 1, 0, 0), 1.0),
    "T": ((0, 1, -2, -1, 0, 0), 1.0),
    "ohm": ((2, 1, -3, -2, 0, 0), 1.0),
    "Ω": ((2, 1, -3, -2, 0, 0), 1.0),
    "l": ((3, 0, 0, 0, 0, 0), 1e-3),
    "L": ((3, 0, 0, 0, 0, 0), 1e-3),
}
ALONE: dict[str, Scale] = {
    "min": ((0, 0, 1, 0, 0, 0), 60.0),
    "h": ((0, 0, 1, 0, 0, 0), 3600.0),
    "sec": ((0, 0, 1, 0, 0, 0), 1.0),
    "t": ((0, 1, 0, 0, 0, 0), 1e3),
    "in": ((1, 0, 0, 0, 0, 0), 0.0254),
    "inch": ((1, 0, 0, 0, 0, 0), 0.0254),
    "ft": ((1, 0, 0, 0, 0, 0), 0.3048),
    "lb": ((0, 1, 0, 0, 0, 0), 0.45359237),
    "lbf": ((1, 1, -2, 0, 0, 0), 4.4482216152605),
    "psi": ((-1, 1, -2, 0, 0, 0), 6894.757293168),
    "ksi": ((-1, 1, -2, 0, 0, 0), 6894757.293168),
    "deg": ((0, 0, 0, 0, 0, 0), PI / 180),
    "°": ((0, 0, 0, 0, 0, 0), PI / 180),
    "rpm": ((0, 0, -1, 0, 0, 0), 2 * PI / 60),
    "Nm": ((2, 1, -2, 0, 0, 0), 1.0),
    "1": ((0, 0, 0, 0, 0, 0), 1.0),
}
LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹·*×", "-0123456789   ")
BRACKETED = re.compile(r"(?:\[([^\[\]]+)\]|\(([^()]+)\))\s*$")
SUFFIX = re.compile(r"_([A-Za-zµ]{2,})$")
FACTOR = re.compile(r"([A-Za-zµμΩ°]+|1)(?:\^?(-?\d+))?$")
ALIKE = 1e-6  # of a size: units no further apart are one


def scale_of(unit: str) -> Scale | None:
    """Dimension and size of a unit, None where it is not known.

    >>> scale_of("N mm")[1], scale_of("kg m/s^2") == scale_of("N"), scale_of("furlong")
    (0.001, True, None)
    """
    text = re.sub(r"(?<=[⁻⁰¹²³⁴⁵⁶⁷⁸⁹])(?=[A-Za-z])", " ", unit).translate(LOWERED).replace("**", "^")
    above, *below = (part.strip().strip("()") for part in text.split("/"))
    if len(below) > 1 or not above:
        return None
    powers, size = [0] * BASES, 1.0
    for part, sign in ((above, 1), *((part, -1) for part in below)):
        for word in part.split():
            match = FACTOR.match(word)
            known = None if match is None else _symbol(match[1])
            if match is None or known is None:
                return None
            power = sign * int(match[2] or 1)
            powers = [p + power * q for p, q in zip(powers, known[0], strict=True)]
            size *= known[1] ** power
    return tuple(powers), size


def _symbol(word: str) -> Scale | None:
    if word in ALONE:
        return ALONE[word]
    for prefix, factor in PREFIXES.items():
        base = PREFIXED.get(word[len(prefix) :]) if word.startswith(prefix) else None
        if base is not None:
            return base[0], factor * base[1]
    return None


def unit_in_header(column: str) -> str | None:
    """The unit that the name of a column ends with, in brackets or behind an underscore; None without.

    >>> [unit_in_header(text) for text in ("mass [kg]", "mass (kg)", "mass_kg", "mass", "x_1", "x_m")]
    ['kg', 'kg', 'kg', None, None, None]
    """
    if match := BRACKETED.search(column):
        return (match[1] or match[2]).strip()
    match = SUFFIX.search(column)
    return match[1] if match and scale_of(match[1]) else None


def without_unit(column: str) -> str:
    """The name of a column without the unit that it ends with.

    >>> [without_unit(text) for text in ("mass [kg]", "mass_kg", "mass")]
    ['mass', 'mass', 'mass']
    """
    if BRACKETED.search(column):
        return BRACKETED.sub("", column).strip()
    return SUFFIX.sub("", column) if unit_in_header(column) else column


def contradiction(column: str, unit: str) -> bool:
    """Whether the name of a column clearly tells another unit than this: both are known and differ.

    Behind an underscore it must measure the same, in another size: `_kg` beside g; `v_ms` may be m/s.

    >>> contradiction("mass [g]", "kg"), contradiction("load (max)", "N")
    (True, False)
    >>> contradiction("gap_mm", "m"), contradiction("v_ms", "m/s")
    (True, False)
    >>> contradiction("n [rpm]", "1/min"), contradiction("n [rpm]", "1/s")
    (False, True)
    """
    theirs = unit_in_header(column)
    if theirs is None or theirs == "1" or unit.strip() in ("", "1"):
        return False
    a, b = scale_of(theirs), scale_of(unit)
    if a is None or b is None:
        return False
    is_alike = any(abs(a[1] * turn - b[1]) <= ALIKE * b[1] for turn in (1.0, 2 * PI, 1 / (2 * PI)))
    if BRACKETED.search(column):
        return a[0] != b[0] or not is_alike
    return a[0] == b[0] and not is_alike

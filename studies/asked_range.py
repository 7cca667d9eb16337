"""The seeds or numbers that a command line asks a study to count: FIRST LAST, the last one left out.

Python's `range` takes 40 and 10 for nothing to do, and a study of nothing prints sums of zeros that look
like a count.
"""

from collections.abc import Sequence

__all__ = ["asked_range"]


def asked_range(words: Sequence[str], *, default: tuple[int, int] = (0, 1)) -> range:
    """The range of the first two of `words`, or `default` without any.

    >>> asked_range(["2000", "2010", "more"]), asked_range([])
    (range(2000, 2010), range(0, 1))

    Raises SystemExit, which ends a command with its message: one number alone, no whole numbers, or a range
    that holds none.
    """
    given = list(words[:2])
    if not given:
        return range(*default)
    try:
        first, last = (int(word) for word in given)
    except ValueError:
        raise SystemExit(f"needs two whole numbers FIRST LAST, got {' '.join(given)}") from None
    if last <= first:
        cure = f": for {last} from {first} on, give {first} {first + last}" if last > 0 else ""
        raise SystemExit(f"FIRST LAST counts FIRST to LAST - 1, and {first} {last} holds none{cure}")
    return range(first, last)

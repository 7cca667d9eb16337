"""What a member is called wherever it is told: the name that its maker gave it, or its kind and a number."""

from collections.abc import Sequence

__all__ = ["member_names"]


def member_names(kinds: Sequence[str], given: Sequence[str] = ()) -> tuple[str, ...]:
    """(members,): the names that are given; of members without one the kind and which of that kind it is.

    >>> member_names(["belt", "airbag", "belt"], ["", "", "lap belt"])
    ('belt 1', 'airbag 1', 'lap belt')
    """
    count: dict[str, int] = {}
    names = []
    for kind, name in zip(kinds, given or [""] * len(kinds), strict=True):
        count[kind] = count.get(kind, 0) + 1
        names.append(name or f"{kind} {count[kind]}")
    return tuple(names)

"""Branch-sparse factors: where they can be non-zero, and what the compiled elimination reads.

A column of a tree meets only the columns before it on its way to the ground, so eliminating from the tips
inwards fills nothing (Featherstone 2008, section 6.5). Elements between branches and first-order states add
entries; the pattern of the factors is found once by eliminating symbolically.
"""

from typing import Any, NamedTuple

import numpy as np

from ...compiler.records import passed_as_record

__all__ = ["Pattern", "elimination"]

Array = np.ndarray[Any, Any]


@passed_as_record
class Pattern(NamedTuple):
    """Columns in the order of elimination; `run` holds each one's later neighbours as ranges."""

    order: Array  # (n,)
    first: Array  # (n + 1,) ranges of order[i]: run[first[i]:first[i + 1]]
    run: Array  # (ranges, 2)


def elimination(arrays: dict[str, Array], states: int) -> Pattern:
    """The pattern of a tree's tables with `states` first-order states behind its columns.

    Conditions of cut joints come last: their diagonal is filled by the columns that they bind.
    """
    link, column, pair, path = (arrays[name] for name in ("link", "column", "pair", "path"))
    n, ground = len(column), len(link)
    conditions = range(n + states, n + states + len(arrays["cut"]))
    near: list[set[int]] = [set() for _ in range(n + states + len(conditions))]

    def join(some: list[int]) -> None:
        for i in some:
            near[i].update(some)

    for j, (own, _) in enumerate(column):
        at = own
        while at != ground:
            _, parent, first, count, _, _ = link[at]
            for i in range(first, first + count):
                near[i].add(j)
                near[j].add(i)
            at = parent
    for _, _, first, last in pair:
        join([int(c) for c, _ in path[first:last]])
    for i, j, _, _ in arrays["coupling_column"]:
        join([int(i), int(j)])
    for name in ("bushing_pair", "surface"):
        for row, state, *more in arrays[name]:
            if state >= 0:
                count = int(more[1]) if name == "surface" else 1
                own = range(n + int(state), n + int(state) + count)
                join([int(c) for c, _ in path[pair[row, 2] : pair[row, 3]]] + [*own])
    for own, (row, _) in zip(conditions, arrays["cut"], strict=True):
        join([int(c) for c, _ in path[pair[row, 2] : pair[row, 3]]] + [own])
    order = [*range(n, n + states), *range(n - 1, -1, -1), *conditions]
    first, runs = [0], []
    done: set[int] = set()
    for k in order:
        done.add(k)
        later = sorted(near[k] - done)
        for i in later:
            near[i].update(later)
        start = None
        for i, c in enumerate(later):
            if start is None:
                start = c
            if i + 1 == len(later) or later[i + 1] != c + 1:
                runs.append([start, c + 1])
                start = None
        first.append(len(runs))
    return Pattern(
        order=np.array(order, np.int64), first=np.array(first, np.int64),
        run=np.array(runs, np.int64).reshape(-1, 2),
    )  # fmt: skip

"""What a screening may be asked to select: groups of parameters that belong together, and how many.

A group has one theta and is selected as a whole: the coordinates of a point, the stiffnesses of one bushing.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

from workbench.errors import StudyError

__all__ = ["check_selection", "chosen"]


class Chosen(TypedDict):
    """Keywords of a screening."""

    groups: Sequence[Sequence[str]]
    n_selected: int | None


def chosen(table: Mapping[str, Any]) -> Chosen:
    """What a `[screen]` table asks for, as keywords of `screen` and `check_selection`."""
    return {"groups": table.get("groups", ()), "n_selected": table.get("n_selected")}


def check_selection(
    names: Sequence[str], *, groups: Sequence[Sequence[str]] = (), n_selected: int | None = None
) -> None:
    """Raise a StudyError for groups or a number that do not fit the parameters `names`.

    >>> check_selection(["x", "y", "mass"], groups=[["x", "y"]], n_selected=2)
    """
    flat = [name for group in groups for name in group]
    for name in flat:
        if name not in names:
            raise StudyError(
                f"groups name parameter {name!r}, which the study does not have; it has {', '.join(names)}"
            )
        if flat.count(name) > 1:
            raise StudyError(
                f"groups name parameter {name!r} twice; a parameter belongs to one group at most"
            )
    if n_selected is None:
        return
    units = len(names) - len(flat) + sum(1 for group in groups if group)
    if not 1 <= n_selected <= units:
        together = " (a group counts as one)" if groups else ""
        raise StudyError(f"n_selected needs a number from 1 to {units}{together}, got {n_selected}")

"""The table `[robust]` of a study in the terms of a comparison: designs, what stays uncertain, constraints.

Parameters that the designs set are ours to choose, the others are uncertain. The study's constraints go where
their parameters are: those of the designs alone are met by every design or refused here, those of uncertain
parameters alone shape the uncertainty, and those that tie both are checked point by point.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.errors import StudyError
from workbench.space import Space
from workbench.study_messages import placed

__all__ = ["Comparison", "check_robust", "comparison_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """What `re_evaluate` is asked: designs by name, the uncertain parameters, and what ties the two."""

    designs: Mapping[str, Mapping[str, Any]]
    uncertainty: Space
    constraints: tuple[str, ...]


def comparison_of(space: Space, table: Mapping[str, Any]) -> Comparison:
    """The comparison that a `[robust]` table asks for.

    Raises:
        StudyError: a design does not fit the space or the others, or nothing is left uncertain.
    """
    designs = {table["design"][k]["name"]: _design(space, table, k) for k in range(len(table["design"]))}
    chosen = _chosen(table)
    uncertain = tuple(p for p in space.parameters if p.name not in chosen)
    if not uncertain:
        raise StudyError("[robust] designs set every parameter, so nothing is uncertain")
    conditions = [c for c in space.conditions if not c.used <= chosen]
    return Comparison(
        designs=designs,
        uncertainty=Space(uncertain, tuple(c.text for c in conditions if not c.used & chosen)),
        constraints=tuple(c.text for c in conditions if c.used & chosen),
    )


def check_robust(space: Space, table: Mapping[str, Any], *, kind: str, text: str, where: str) -> None:
    """Refuse a `[robust]` table that cannot be run, with file and line; `kind` is that of the model."""
    for k in range(len(table["design"])):
        with placed(text, where, ("robust", "design", k)):
            _design(space, table, k)
    with placed(text, where, ("robust",)):
        comparison_of(space, table)
        if kind == "table":
            raise StudyError("[robust] needs a model that can be run; a table cannot run anything new")
    with placed(text, where, ("robust", "screened")):
        if table.get("screened", 0) > table["samples"]:
            raise StudyError(
                f"[robust] screened needs at most samples={table['samples']}, got {table['screened']}"
            )


def _chosen(table: Mapping[str, Any]) -> set[str]:
    return {name for design in table["design"] for name in design["values"]}


def _design(space: Space, table: Mapping[str, Any], k: int) -> dict[str, Any]:
    """The checked values of design k."""
    name, values = table["design"][k]["name"], table["design"][k]["values"]
    if name in [design["name"] for design in table["design"][:k]]:
        raise StudyError(f"[robust] design {name!r} is given twice; every name may stand once")
    missing = sorted(_chosen(table) - set(values))
    unknown = sorted(set(values) - set(space.names))
    if missing or unknown:
        wrong = f"lacks {missing[0]!r}" if missing else f"names {unknown[0]!r}, which is no parameter"
        raise StudyError(f"[robust] design {name!r} {wrong}; every design sets the same parameters")
    try:
        checked = {key: space[key].canonical(value) for key, value in values.items()}
    except StudyError as exc:
        raise StudyError(f"[robust] design {name!r}: {exc}") from None
    for condition in space.conditions:
        if condition.used <= set(values) and not condition.holds(checked):
            raise StudyError(f"[robust] design {name!r} breaks the constraint {condition.text!r}")
    return checked

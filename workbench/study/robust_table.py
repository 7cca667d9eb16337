"""The table `[robust]` of a study in the terms of a comparison: designs, what stays uncertain, constraints.

Parameters that the designs set are ours to choose, the others are uncertain. The study's constraints go where
their parameters are: those of the designs alone are met by every design or refused here, those of uncertain
parameters alone shape the uncertainty, and those that tie both are checked point by point.

The nominal scenario, at which the price of robustness is read, is made of the table `nominal` and of the
baselines of the uncertain parameters that it does not name. Without a table it is there when every uncertain
parameter has a baseline, and left out with a reason when these are no point of the uncertainty.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.errors import StudyError
from workbench.space.box import Space
from workbench.space.common_ground import Ground
from workbench.study.messages import placed

__all__ = ["Comparison", "check_robust", "comparison_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """What `re_evaluate` is asked: designs by name, the uncertain parameters, and what ties the two.

    `nominal` is None where the study names no nominal scenario; `no_nominal` says why its baselines are none.
    """

    designs: Mapping[str, Mapping[str, Any]]
    uncertainty: Space
    constraints: tuple[str, ...]
    nominal: Mapping[str, Any] | None
    no_nominal: str | None = None


def comparison_of(space: Space, table: Mapping[str, Any]) -> Comparison:
    """The comparison that a `[robust]` table asks for.

    Raises:
        StudyError: a design does not fit the space or the others, nothing is left uncertain, or the nominal
            scenario is not one that every design may meet.
    """
    designs = {table["design"][k]["name"]: _design(space, table, k) for k in range(len(table["design"]))}
    chosen = _chosen(table)
    uncertain = tuple(p for p in space.parameters if p.name not in chosen)
    if not uncertain:
        raise StudyError("[robust] designs set every parameter, so nothing is uncertain")
    conditions = [c for c in space.conditions if not c.used <= chosen]
    uncertainty = Space(uncertain, tuple(c.text for c in conditions if not c.used & chosen))
    constraints = tuple(c.text for c in conditions if c.used & chosen)
    ground = Ground.of(uncertainty, designs, constraints)
    nominal, no_nominal = _nominal(ground, table.get("nominal"))
    return Comparison(
        designs=designs,
        uncertainty=uncertainty,
        constraints=constraints,
        nominal=nominal,
        no_nominal=no_nominal,
    )


def check_robust(space: Space, table: Mapping[str, Any], *, kind: str, text: str, where: str) -> None:
    """Refuse a `[robust]` table that cannot be run, with file and line; `kind` is that of the model."""
    for k in range(len(table["design"])):
        with placed(text, where, ("robust", "design", k)):
            _design(space, table, k)
    with placed(text, where, ("robust", "nominal")):
        comparison_of(space, table)
    with placed(text, where, ("robust",)):
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


def _nominal(ground: Ground, given: Mapping[str, Any] | None) -> tuple[Mapping[str, Any] | None, str | None]:
    """The nominal scenario; or None, and why the baselines are none when nothing was given."""
    space = ground.uncertainty
    stray = next((name for name in given or {} if name not in space.names), None)
    if stray is not None:
        what = (
            "which the designs set"
            if any(stray in d for d in ground.designs.values())
            else "which is no parameter"
        )
        raise StudyError(
            f"[robust] nominal names {stray!r}, {what}; the uncertain parameters are {', '.join(space.names)}"
        )
    values = {p.name: (given or {}).get(p.name, p.baseline) for p in space.parameters}
    missing = next((name for name, value in values.items() if value is None), None)
    if missing is not None and given is None:
        return None, None
    if missing is not None:
        raise StudyError(f"[robust] nominal lacks {missing!r}, which has no baseline; give it a value")
    try:
        ground.check((), values)
    except StudyError as exc:
        if given is not None:
            raise StudyError(f"[robust] {exc}") from None
        return None, f"no price of robustness from the baselines: {exc}"
    return space.canonical(values), None

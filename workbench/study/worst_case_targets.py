"""What the `[worst_case]` table of a study searches: one response, several, or a weighted sum.

    response = "stress"                                   the worst of one
    response = "stress", within = { travel = [-inf, 0.6] }    of those runs whose travel is at most 0.6
    responses = { stress = "max", clearance = "min" }     the worst of each, from one set of runs
    weights = { stress = 1.0, travel = 0.5 }              the worst of the sum

The names are those of `worst_case`, `worst_cases`, `weighted` and `within` in Python.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from workbench.errors import StudyError
from workbench.models.evaluator import Reading
from workbench.models.readings import refuse_own_limit, weighted, within
from workbench.study.record import Study

__all__ = ["CHECKS", "QUANTILE_BUDGET", "Target", "targets"]

QUANTILE_BUDGET = 40  # runs, where the study says none
CHOICE = ("response", "responses", "weights")
OF_ONE = ("lipschitz", "enclosure")


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A number to search the worst of. `reading` is what a search takes, `reads` the responses it needs."""

    name: str
    unit: str
    sense: str
    reading: str | Reading
    reads: tuple[str, ...]
    # what a reader of the document must know beside the name: the limits or the weights
    notes: Mapping[str, Any] = field(default_factory=dict)


def targets(study: Study) -> list[Target]:
    """What a study's `[worst_case]` searches, the most important first."""
    table = study.worst_case or {}
    sense = table.get("sense", "max")
    if "responses" in table:
        found = [(study.target(name), side) for name, side in table["responses"].items()]
        return [
            Target(name=one.name, unit=one.unit, sense=side, reading=one.name, reads=(one.name,))
            for one, side in found
        ]
    if "weights" in table:
        weights = {study.target(name).name: weight for name, weight in table["weights"].items()}
        return [
            Target(
                name=_sum_name(weights), unit="1", sense=sense, reading=weighted(weights),
                reads=tuple(weights), notes={"weights": weights},
            )
        ]  # fmt: skip
    response = study.target(table["response"])
    within_table = table.get("within", {}).items()
    limits = {study.target(name).name: (low, high) for name, (low, high) in within_table}
    return [
        Target(
            name=response.name,
            unit=response.unit,
            sense=sense,
            reading=within(response.name, limits) if limits else response.name,
            reads=(response.name, *limits),
            notes={"within": {name: list(pair) for name, pair in limits.items()}} if limits else {},
        )
    ]


def _sum_name(weights: Mapping[str, float]) -> str:
    """A sum as a person writes it.

    >>> _sum_name({"a": 1.0, "b": -0.5})
    'a - 0.5 b'
    """
    terms = [
        ("-" if weight < 0 else "+", name if abs(weight) == 1 else f"{abs(weight):g} {name}")
        for name, weight in weights.items()
    ]
    text = " ".join(f"{sign} {term}" for sign, term in terms)
    return text.removeprefix("+ ")


def _check_choice(study: Study, table: Mapping[str, Any]) -> None:
    given = [key for key in CHOICE if key in table]
    if len(given) != 1:
        raise StudyError(
            "[worst_case] needs one of response = \"y\", responses = { y = \"max\", z = \"min\" } and "
            f"weights = {{ y = 1.0, z = 0.5 }}, got {' and '.join(given) or 'none'}"
        )  # fmt: skip
    if "response" in table:
        study.target(table["response"])


def _check_responses(study: Study, table: Mapping[str, Any]) -> None:
    for name in table.get("responses", ()):
        study.target(name)
    stray = [key for key in ("sense", *OF_ONE) if key in table]
    if "responses" in table and stray:
        cure = {"sense": "it gives every response its own"}.get(stray[0], "search that response alone")
        raise StudyError(f"[worst_case] responses does not go with {stray[0]}: {cure}")


def _check_weights(study: Study, table: Mapping[str, Any]) -> None:
    for name, weight in table.get("weights", {}).items():
        study.target(name)
        if weight == 0:
            raise StudyError(f"[worst_case] weights.{name} needs a number other than 0, got 0. Leave it out")


def _check_within(study: Study, table: Mapping[str, Any]) -> None:
    if "within" in table and "response" not in table:
        raise StudyError("[worst_case] within goes with response, the one whose worst is searched")
    for name, (low, high) in table.get("within", {}).items():
        study.target(name)
        if low is None and high is None:
            raise StudyError(f"[worst_case] within.{name} leaves both sides open. Leave it out")
        if low is not None and high is not None and low > high:
            raise StudyError(f"[worst_case] within.{name} needs [low, high], got [{low:g}, {high:g}]")
    if "within" in table:
        refuse_own_limit(table["response"], table["within"], table.get("sense", "max"))


def _check_quantile(study: Study, table: Mapping[str, Any]) -> None:
    if "quantile" not in table:
        if "quantile_budget" in table:
            raise StudyError("[worst_case] quantile_budget goes with quantile, such as quantile = 0.95")
        return
    stray = next((key for key in ("responses", "within") if key in table), None)
    if stray is not None:
        raise StudyError(
            f"[worst_case] quantile does not go with {stray}: it is that of one number over all uncertainty"
        )
    if study.model["kind"] == "table":
        raise StudyError(
            "[worst_case] quantile needs a model that can be run; a table cannot run anything new"
        )


def _check_noise(study: Study, table: Mapping[str, Any]) -> None:
    if not table.get("noise"):
        return
    stray = next((key for key in ("attack", *OF_ONE, "quantile") if table.get(key)), None)
    if stray is not None:
        raise StudyError(
            f"[worst_case] noise = true does not go with {stray}, which takes every run for exact. "
            "Leave one out"
        )
    if study.model["kind"] == "table":
        raise StudyError(
            "[worst_case] noise = true needs a model that can be run again; a table cannot run anything new"
        )


def _check_transform(study: Study, table: Mapping[str, Any]) -> None:
    if table.get("noise") and table.get("transform", "auto") not in ("auto", "none"):
        raise StudyError(
            f"[worst_case] transform = {table['transform']!r} does not go with noise = true: the mean is "
            "searched, which is that of the response itself. Leave one out"
        )


# by the key at whose line a refusal is placed
CHECKS = {
    "response": _check_choice,
    "responses": _check_responses,
    "weights": _check_weights,
    "within": _check_within,
    "quantile": _check_quantile,
    "noise": _check_noise,
    "transform": _check_transform,
}

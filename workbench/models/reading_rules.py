"""Which keys each kind of `read` takes, and what they must look like."""

import re
from collections.abc import Mapping
from typing import Any

from workbench.errors import StudyError

__all__ = ["KEYS", "checked_rule"]

# kind -> keys it needs, keys it may have
KEYS: dict[str, tuple[frozenset[str], frozenset[str]]] = {
    "json": (frozenset({"file", "key"}), frozenset()),
    "csv": (frozenset({"file", "column"}), frozenset({"time"})),
    "columns": (frozenset({"file"}), frozenset({"column", "time", "skip", "characters", "time_characters"})),
    "regex": (frozenset({"file", "pattern"}), frozenset({"which"})),
    "request": (frozenset({"file", "request", "column"}), frozenset()),
    "python": (frozenset({"function"}), frozenset()),
}


def checked_rule(response: str, rule: Mapping[str, Any], *, reduced: bool) -> dict[str, Any]:
    """The rule without empty keys, or a refusal that names what is missing or too much."""
    given = {key: value for key, value in rule.items() if value is not None}
    kind = given["kind"]
    needs, may = KEYS[kind]
    keys = set(given) - {"kind"}
    missing, stray = sorted(needs - keys), sorted(keys - needs - may)
    if missing or stray:
        wrong = f"needs {missing[0]}" if missing else f"takes no {stray[0]}"
        takes = ", ".join(sorted(needs | may))
        raise StudyError(f"response {response!r}: read of kind {kind!r} {wrong}; its keys are {takes}")
    if kind == "columns":
        _check_columns(response, given)
    names = kind in ("csv", "request")
    for key in ("column", "time"):
        if key in given and isinstance(given[key], str) != names:
            word = "the name of a column" if names else "the number of a column, from 1"
            raise StudyError(f"response {response!r}: {key} is {word}, got {given[key]!r}")
    if kind == "regex" and reduced:
        raise StudyError(f"response {response!r}: a regular expression finds one number; leave reduce out")
    if kind == "regex":
        try:
            re.compile(given["pattern"])
        except re.error as exc:
            raise StudyError(f"response {response!r}: pattern {given['pattern']!r}: {exc}") from None
    return given


def _check_columns(response: str, given: Mapping[str, Any]) -> None:
    if ("column" in given) == ("characters" in given):
        raise StudyError(
            f"response {response!r}: read of kind 'columns' needs column or characters, not both"
        )
    for key in ("characters", "time_characters"):
        place = given.get(key)
        if place is not None and (len(place) != 2 or place[0] > place[1]):
            raise StudyError(
                f"response {response!r}: {key} needs first and last, such as [11, 22], got {place}"
            )

"""The worst case of each response."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.statements import (
    ended_text,
    failure_of,
    known_text,
    limits_text,
    quantile_text,
    runs_text,
    worst_digits,
)
from workbench.report.lines.tables import format_number, table_lines, unit_suffix, wrapped

__all__ = ["worst_case_lines"]


def worst_case_lines(document: Mapping[str, Any]) -> list[str]:
    """The worst case, what it rests on, and what remains open; then those of other responses."""
    lines = _one_worst_case(document)
    for other in document.get("others") or ():
        lines += ["", *_one_worst_case(other)]
    return lines


def _one_worst_case(document: Mapping[str, Any]) -> list[str]:
    unit = unit_suffix(document["unit"])
    word = {"max": "largest", "min": "smallest"}[document["sense"]]
    kind = f"{document['regime_name']}, " if document.get("regime_name") else ""
    value = f"{format_number(document['value'], worst_digits(document))}{unit}"
    border, failure = document.get("border"), failure_of(document)
    found = kind + value if failure is None else "a run that failed"
    text = [f"Worst case ({word} {document['response']}): {found}"]
    if document.get("within"):
        text.append(f"  of the runs with {limits_text(document['within'])}")
    text += [f"  {line}" for mode in document.get("modes") or () for line in wrapped(mode["sentence"], 77)]
    runs = runs_text(document)
    if failure is not None:
        text += [f"  {line}" for line in wrapped(failure["sentence"], 77)]
        text += [
            f"  the worst that gave a value: {value}, {document['label']}",
            *([f"  {runs}"] if runs else []),
        ]
    else:
        label = "; ".join(part for part in (document["label"], runs) if part)
        text += [f"  {line}" for line in wrapped(label, 77)]
    if known := known_text(document):
        text.append(f"  {known}")
    if ended := ended_text(document):
        why = f"stopped because {ended}" if document["budget"] else ended
        text += [f"  {line}" for line in wrapped(why, 77)]
    if document.get("grade_sentence") and document.get("confirmed", True):  # else nothing was searched
        text += [f"  {line}" for line in wrapped(document["grade_sentence"], 77)]
    if document.get("gap"):
        text += [f"  {line}" for line in wrapped(document["gap"]["sentence"], 77)]
    if border and failure is None:
        text += [f"  {line}" for line in wrapped(border["sentence"], 77)]
    if document.get("quantile"):
        text += [f"  {line}" for line in wrapped(quantile_text(document["quantile"]), 77)]
    if document.get("regime"):
        text += [f"  {line}" for line in wrapped(document["regime"], 77)]
    if document.get("scale") and document["scale"]["used"] != "none":
        text += [f"  {line}" for line in wrapped(document["scale"]["reason"], 77)]
    failures = document.get("failures") or {}
    if failures:
        text.append(
            "  runs without a value: " + ", ".join(f"{n} {status}" for status, n in sorted(failures.items()))
        )
    parameters = document["parameters"]
    if failure is not None:
        both = [(name, "", _value(failure["parameters"][name]), _value(v)) for name, v in parameters.items()]
        head = ("", "", "the failed run", "the worst that gave a value")
        return text + [f"  {line}" for line in table_lines(head, both, width=77)]
    width = max(len(name) for name in parameters)
    text += [f"  {name:<{width}} = {_value(value)}" for name, value in parameters.items()]
    return text


def _value(value: Any) -> str:
    return (
        format_number(value, 6)
        if isinstance(value, int | float) and not isinstance(value, bool)
        else str(value)
    )

"""What is required of a layout, whether it is met, and on what that rests: one sentence for each."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.tables import format_number, unit_suffix
from workbench.search.evidence.attack.share import at_least, at_most

__all__ = ["requirement_text"]

RESTS_ON = {
    "proved": "proved: all cases there are were run",
    "attacked": "attacked: an adversary looked for the worst",
    "searched": "searched: the loop is not closed",
    "sampled": "sampled: the adversary looked for the worst of {attacked}, not of this",
}


def requirement_text(asked: Mapping[str, Any], *, attacked: str) -> str:
    """A sentence of an entry of `requirements`.

    attacked: the response that the loop attacked.

    >>> found = {"runs": 9, "within": 9, "low": 0.1, "high": 0.3, "case": None}
    >>> asked = {"response": "rise", "unit": "m", "low": None, "high": 0.4, "grade": "attacked"}
    >>> sampled = {"runs": 20, "within": 20, "share": [0.861, 1.0]}
    >>> asked |= {"met": True, "found": found, "sampled": {"runs": 20, "within": 20, "share": [0.861, 1.0]}}
    >>> requirement_text(asked, attacked="rise").partition(", 0.1")[0]
    'Required, rise at most 0.4 m: pass'
    """
    unit, cases, samples = unit_suffix(asked["unit"]), asked["found"], asked["sampled"]
    ends = f"{format_number(cases['low'], 4)} to {format_number(cases['high'], 4)}{unit}"
    if cases["low"] is None:
        ends = "no value"
    parts = (
        f"Required, {asked['response']} {_asked(asked, unit)}: {_verdict(asked, unit)}, {ends} ",
        f"in the cases found, as required in {cases['within']} of {cases['runs']} of them and in ",
        f"{samples['within']} of {samples['runs']} samples (with 95 % confidence ",
        f"{_share(samples['share'])} of the uncertainty); ",
        _rests_on(asked, attacked),
    )
    return "".join(parts) + "."


def _rests_on(asked: Mapping[str, Any], attacked: str) -> str:
    """The grade and what it means; a loop may have been attacked and not be closed."""
    runs = asked.get("attack_runs")  # unknown in documents from before
    if asked["grade"] == "searched" and runs is not None:
        who = f"{runs} true runs of an adversary" if runs else "no adversary has"
        return f"searched: {who} looked for the worst, and the loop is not closed"
    return RESTS_ON[asked["grade"]].format(attacked=attacked)


def _verdict(asked: Mapping[str, Any], unit: str) -> str:
    """Pass or fail; of a loop that is not closed, whether what another attack may find would still pass."""
    reach = asked.get("may_reach")
    if asked["met"] and reach is not None and asked["high"] is not None and reach > asked["high"]:
        return f"pass so far, but another attack may find {format_number(reach, 4)}{unit}"
    is_open = asked["grade"] == "searched" and "may_reach" in asked  # not in documents from before
    if asked["met"] and is_open and reach is None and asked["high"] is not None:
        return "pass so far, but how much more another attack may find is not known"
    return "pass" if asked["met"] else "fail"


def _asked(asked: Mapping[str, Any], unit: str) -> str:
    low, high = asked["low"], asked["high"]
    if low is None:
        return f"at most {format_number(high)}{unit}"
    if high is None:
        return f"at least {format_number(low)}{unit}"
    return f"from {format_number(low)} to {format_number(high)}{unit}"


def _share(ends: tuple[float, float]) -> str:
    low, high = ends
    if low <= 0.0:
        return f"at most {at_most(high, digits=3)}"
    least = at_least(low, digits=3)
    return f"at least {least}" if high >= 1.0 else f"{least} to {at_most(high, digits=3)}"

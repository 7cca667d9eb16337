"""Statements on a screening and a worst case that the terminal and the page make in the same words."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from workbench.report.lines.tables import format_number, unit_suffix
from workbench.space.units import digits_apart, significant

__all__ = [
    "border_text",
    "ended_text",
    "failure_of",
    "known_text",
    "limits_text",
    "minor_text",
    "open_text",
    "quantile_text",
    "regime_name",
    "regime_of",
    "regime_text",
    "runs_text",
    "scale_text",
    "screening_state",
    "sentence",
    "share_of_variance",
    "state_text",
    "variance_text",
    "worst_digits",
]


def limits_text(limits: Mapping[str, Sequence[float | None]]) -> str:
    """What keeps to its limits, as a person says it.

    >>> limits_text({"travel": [None, 0.6], "load": [1.0, 2.0]})
    'travel <= 0.6 and 1 <= load <= 2'
    """
    parts = []
    for name, (low, high) in limits.items():
        left = "" if low is None else f"{format_number(low)} <= "
        parts.append(left + name + ("" if high is None else f" <= {format_number(high)}"))
    return " and ".join(parts)


def known_text(worst: Mapping[str, Any]) -> str:
    """The worst value that a run gave, beside a worst case that is predicted only; "" where one was run.

    >>> given = {"the runs given": {"runs": 36, "value": 10.64, "run_key": "c3"}}
    >>> known_text({"confirmed": False, "baselines": given, "unit": "kN"})
    'the worst of the 36 runs given is 10.64 kN'
    """
    given = (worst.get("baselines") or {}).get("the runs given")
    if worst.get("confirmed", True) or given is None:
        return ""
    unit = unit_suffix(str(worst.get("unit") or "1"))
    runs = given["runs"] - given.get("failed", 0)
    which = f"the {runs} runs given" if runs == given["runs"] else f"the {runs} runs given that have a value"
    return f"the worst of {which} is {format_number(given['value'], worst_digits(worst))}{unit}"


def worst_digits(worst: Mapping[str, Any], *, show: Callable[[float, int], str] = significant) -> int:
    """How many digits tell a worst case from the worst run given and from the mildest run that is known.

    >>> given = {"the runs given": {"runs": 36, "value": 999999999.489, "run_key": "c3"}}
    >>> worst_digits({"value": 999999999.046, "baselines": given}), worst_digits({"value": 3.5})
    (11, 6)
    """
    known = [run["value"] for run in worst.get("history") or () if run["value"] is not None]
    given = (worst.get("baselines") or {}).get("the runs given") or {}
    ends = (min(known), max(known)) if known else ()
    return digits_apart([worst.get("value"), given.get("value"), *ends], show=show)


def failure_of(worst: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The failed run that is the worst case by `failures = "worst"`, with its parameters; None without."""
    border = worst.get("border") or {}
    return border if border.get("is_answer") else None


def ended_text(worst: Mapping[str, Any]) -> str:
    """Why a search ended, without its full stop; "" where it does not say.

    >>> failed = {"status": "a run failed", "border": {"is_answer": True}}
    >>> ended_text({**failed, "history": [{"proposal": "even"}, {"proposal": "even"}]})
    'a run failed; the 2 runs after it are an even sample that says how much of the box fails'
    """
    said = str(worst.get("status") or "").rstrip(".")
    even = sum(run.get("proposal") == "even" for run in worst.get("history") or ())
    if failure_of(worst) is None or not even:
        return said
    runs = "the run after it is" if even == 1 else f"the {even} runs after it are"
    return f"{said}; {runs} an even sample that says how much of the box fails"


def runs_text(worst: Mapping[str, Any]) -> str:
    """How many runs of how many a search made; "" of a table, where none could be.

    Cases of the attack that had been run before were not run again, and the budget is spent all the same.
    So it is by a run made again to ask for noise, which teaches nothing where there is none.

    >>> attack = {"runs": 8}
    >>> history = [{"proposal": "start"}] * 12 + [{"proposal": "attack: corner"}] * 6
    >>> runs_text({"evaluations": 18, "budget": 20, "attack": attack, "history": history})
    '18 runs of at most 20, 2 cases of the attack had been run before'
    >>> runs_text({"evaluations": 11, "budget": 12, "made_again": 1})
    '11 runs of at most 12, and the worst run made again to see whether runs have noise'
    """
    if not worst["budget"]:
        return ""
    said = f"{worst['evaluations']} runs of at most {worst['budget']}"
    if worst.get("made_again"):
        said += ", and the worst run made again to see whether runs have noise"
    attack = worst.get("attack") or {"runs": 0}
    new = sum(str(run.get("proposal")).startswith("attack") for run in worst.get("history") or ())
    again = attack["runs"] - new
    if again <= 0:
        return said
    return f"{said}, {'1 case' if again == 1 else f'{again} cases'} of the attack had been run before"


def quantile_text(quantile: Mapping[str, Any]) -> str:
    """What is exceeded with a small chance only, in a sentence without its full stop."""
    unit = unit_suffix(quantile["unit"])
    side = "above" if quantile["sense"] == "max" else "below"
    cases = "the cases that give a value" if quantile.get("failed") else "all cases"
    return (
        f"in {100 * (1 - quantile['share']):.3g} % of {cases} {quantile['response']} lies {side} "
        f"{format_number(quantile['value'])}{unit} (between {format_number(quantile['lower'])} and "
        f"{format_number(quantile['upper'])}{unit}, by the Kriging of "
        f"{quantile['known'] + quantile['evaluations']} runs)"
    )


def screening_state(screening: Mapping[str, Any]) -> str:
    """The state of a screening document, "" where it has none."""
    if state := screening.get("state"):
        return str(state)
    resolved = (screening.get("diagnosis") or {}).get("resolved")
    return "" if resolved is None else "resolved" if resolved else "not resolved"


def open_text(screening: Mapping[str, Any]) -> str:
    """Which selected parameters are open, with the most that each can do; "" where none is.

    >>> open_text({"diagnosis": {"open": ["grip"], "open_share": 0.034}})
    'Whether grip acts is open: at most 3.4 % of the variance.'
    >>> open_text({"diagnosis": {"open": ["grip"], "open_share": 1.0}})
    'Whether grip acts is open: at most 100 % of the variance.'
    """
    diagnosis = screening.get("diagnosis") or {}
    names = diagnosis.get("open") or []
    if not names:
        return ""
    act, each = ("act", "each ") if len(names) > 1 else ("acts", "")
    share = share_of_variance(float(diagnosis["open_share"]))
    return (
        f"Whether {' and '.join(names)} {act} is open: {each}at most {share} of {variance_text(screening)}."
    )


def border_text(screening: Mapping[str, Any]) -> str:
    """Which parameters lie at the border of the list; "" where none does.

    >>> border_text({"diagnosis": {"border": ["grip"]}})
    'grip lies at the border of 1 % of the variance: listed, or not, by chance.'
    """
    names = (screening.get("diagnosis") or {}).get("border") or []
    if not names:
        return ""
    lies, of = "lie" if len(names) > 1 else "lies", variance_text(screening)
    return f"{' and '.join(names)} {lies} at the border of 1 % of {of}: listed, or not, by chance."


def minor_text(screening: Mapping[str, Any]) -> str:
    """Which parameters act and stay below one percent; "" where none is listed apart.

    >>> minor_text({"minor": ["grip", "mass"]})
    'Listed apart, estimated below 1 % of the variance each: grip and mass.'
    """
    names = list(screening.get("minor") or [])
    if not names:
        return ""
    said = f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
    each = " each" if len(names) > 1 else ""
    return f"Listed apart, estimated below 1 % of {variance_text(screening)}{each}: {said}."


def sentence(said: str) -> str:
    """A statement as a sentence of a page; "" stays "".

    >>> sentence("the loop is not closed")
    'The loop is not closed.'
    """
    return f"{said[0].upper()}{said[1:]}." if said else ""


def regime_text(screening: Mapping[str, Any]) -> list[str]:
    """What a response that switches asks for, in sentences without their full stops; [] where it does not.

    What is said of all runs is said of both regimes together.
    """
    found = screening.get("regimes")
    if not found:
        return []
    switch = found["switch"]
    by = "nothing shows what switches it"
    if switch["selected"]:
        by = f"it is switched by {', '.join(switch['selected'])}"
    seen = f"of runs left out {switch['right']} of {switch['runs']} are put into the right one"
    said = [str(found["sentence"]), f"{by} ({switch['state']}); {seen}"]
    for one in found["regimes"]:
        drivers = ", ".join(one["selected"]) or "no parameter is seen to matter"
        inside = f'"{one["name"]}"' if found["named"] else one["name"]
        said.append(f"inside {inside} ({one['runs']} runs, {one['state']}): {drivers}")
    return [*said, "what is said of all runs is said of both regimes together"]


def regime_name(value: float, screening: Mapping[str, Any] | None) -> str:
    """What the study calls the regime that a value lies in, "" where it gives no names or there is one only.

    >>> regimes = [{"name": "held"}, {"name": "left the vehicle"}]
    >>> regime_name(9.0, {"regimes": {"threshold": 4.0, "named": True, "regimes": regimes}})
    'left the vehicle'
    """
    found = (screening or {}).get("regimes")
    if not found or not found["named"]:
        return ""
    return str(found["regimes"][int(value > found["threshold"])]["name"])


def regime_of(value: float, screening: Mapping[str, Any]) -> str:
    """Which regime of a screened response a value lies in, "" where it has one only.

    >>> regimes = [{"name": "held"}, {"name": "gone"}]
    >>> regime_of(9.0, {"regimes": {"threshold": 4.0, "named": True, "regimes": regimes}})
    'It lies in the regime "gone", above 4; runs below are no milder form of it.'
    """
    found = screening.get("regimes")
    if not found:
        return ""
    is_upper = value > found["threshold"]
    name = found["regimes"][int(is_upper)]["name"]
    inside = f'the regime "{name}"' if found["named"] else name
    at = format_number(found["threshold"])
    if is_upper:
        return f"It lies in {inside}, above {at}; runs below are no milder form of it."
    return f"It lies in {inside}, below {at}; runs above are of another kind."


def scale_text(screening: Mapping[str, Any]) -> str:
    """The scale that the parameters were selected by, where it is not the response itself.

    >>> scale_text({"scale": "the logarithm of the response (left unexplained: none 5 %, log 0.1 %)"})
    'Screened by the logarithm of the response.'
    """
    scale = str(screening.get("scale") or "").split(" (left unexplained")[0]
    return f"Screened by {scale}." if scale else ""


def state_text(screening: Mapping[str, Any]) -> str:
    """The state with its number.

    >>> state_text({"state": "partly resolved", "hidden_share": 0.034})
    'partly resolved, down to 3.4 % of the variance'
    >>> state_text({"state": "not resolved", "hidden_share": 0.6})
    'not resolved'
    >>> state_text({"state": "partly resolved", "hidden_share": 0.09, "selected": ["a"], "ranking": ["a"]})
    'partly resolved, all parameters selected'
    >>> state_text({"state": "resolved", "hidden_share": 0.01, "minor": ["a"], "ranking": ["a"]})
    'resolved, every parameter selected or listed apart'
    """
    state, share = screening_state(screening), screening.get("hidden_share")
    if state not in ("resolved", "partly resolved") or share is None:
        return state
    if lists_all(screening):
        apart = screening.get("minor")
        return (
            f"{state}, {'every parameter selected or listed apart' if apart else 'all parameters selected'}"
        )
    return f"{state}, down to {share_of_variance(float(share))} of {variance_text(screening)}"


def share_of_variance(share: float) -> str:
    """As a verdict says it (`surrogates.screening.hidden_share.percent`, too slow to load for a terminal).

    >>> share_of_variance(0.034), share_of_variance(1e-5), share_of_variance(1.0)
    ('3.4 %', '0.1 %', '100 %')
    """
    said = max(100.0 * share, 0.1)
    return f"{said:.0f} %" if said >= 9.95 else f"{said:.1f} %"


def variance_text(screening: Mapping[str, Any]) -> str:
    """What the shares that a screening tells are shares of.

    >>> variance_text({"diagnosis": {"shares_of": "ranks"}}), variance_text({})
    ('the variance of the ranks', 'the variance')
    """
    of_ranks = (screening.get("diagnosis") or {}).get("shares_of") == "ranks"
    return "the variance of the ranks" if of_ranks else "the variance"


def lists_all(screening: Mapping[str, Any]) -> bool:
    """Whether every parameter that varies is selected, or stands apart: none is left to hide."""
    constant = (screening.get("diagnosis") or {}).get("constant") or []
    known = {*(screening.get("selected") or []), *(screening.get("minor") or []), *constant}
    ranked = screening.get("ranking") or []
    return bool(ranked) and known >= set(ranked)

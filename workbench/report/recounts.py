"""Numbers of a document made again from what stands beside them, by another way than they were made.

A terminal and a page print means, shares and gaps from documents, beside the values that these are made of. A
number that is not that of its own values is refused (`workbench.report.claims`) before anything is written.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import fsum, inf, isclose
from typing import Any

__all__ = ["against_rounds", "against_search", "against_summary"]

ROUNDING = 1e-9  # of the largest number of a comparison: what a sum in another order may change
QUANTILES = {"P5": 0.05, "P50": 0.5, "P95": 0.95}


def against_summary(document: Mapping[str, Any], summary: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against the numbers of one design in `robust.json`: the values of all designs.

    Not made again: intervals, and the values at nominal, whose runs the document does not hold.
    """
    name, sign = summary["design"], 1.0 if document["sense"] == "max" else -1.0
    rows = list(zip(*document["values"].values(), strict=True))
    own = document["values"][name]
    whole = [k for k, row in enumerate(rows) if None not in row]
    drawn = document["drawn"]
    sample = sorted(own[k] for k in whole if k < drawn)
    regrets = [sign * own[k] - min(sign * v for v in rows[k]) for k in whole]
    lost = sum(v is None for v in own[:drawn])
    made: dict[str, tuple[float, float]] = {
        "mean": (summary["mean"], fsum(v / len(sample) for v in sample)),
        "worst value met": (summary["worst"], sign * max(sign * own[k] for k in whole)),
        "largest regret": (summary["largest_regret"], max(regrets)),
        "mean regret": (summary["mean_regret"], fsum(regret / len(regrets) for regret in regrets)),
        "number of failures": (summary["failed"], lost),
        "share of failures": (summary["failed_share"][0], lost / drawn),
        **{
            f"quantile {mark}": (summary["quantiles"][mark][0], _quantile(sample, share))
            for mark, share in QUANTILES.items()
        },
    }
    if summary["beyond_or_failed"] is not None:
        limit = sign * document["limit"]
        bad = lost + sum(v is not None and sign * v > limit for v in own[:drawn])
        made["share beyond the limit or failed"] = (summary["beyond_or_failed"][0], bad / drawn)
    if summary["price_of_robustness"] is not None:
        there = [sign * s["nominal"] for s in document["summaries"] if s["nominal"] is not None]
        price = sign * summary["nominal"] - min(there)
        made["price of robustness"] = (summary["price_of_robustness"], price)
    first = document["designs"][0]
    paired = document["paired"].get(f"{name} - {first}")
    if paired is not None:
        base = document["values"][first]
        mean = fsum((own[k] - base[k]) / len(sample) for k in whole if k < drawn)
        made[f"mean difference to '{first}'"] = (paired[0], mean)
    size = max((abs(v) for row in rows for v in row if v is not None), default=0.0)
    yield from _differing(made, size)
    if document["left_out"] != drawn - len(sample):
        yield f"{document['left_out']} scenarios are said to be left out where {drawn - len(sample)} are"
    for (less, low), (more, high) in pairwise((mark, summary["quantiles"][mark][0]) for mark in QUANTILES):
        if low > high:
            yield f"its quantile {less} lies above its quantile {more}"


def against_rounds(document: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against the rounds and the layouts that `robust_layout.json` has side by side."""
    for number, one in enumerate(document["rounds"], start=1):
        bound, worst = one["bound"], one["worst"]
        if None in (bound, worst, one["gap"]):
            continue  # a layout without a value in one of its cases
        above = max(worst - bound, 0.0)
        gap = above / abs(bound) if bound else above
        if abs(one["gap"] - gap) > ROUNDING * max(1.0, abs(gap)):
            yield (
                f"round {number} says a gap of {100 * one['gap']:.4g} % where {worst:.6g} instead of "
                f"{bound:.6g} is {100 * gap:.4g} %"
            )
    for name, kept in document["layouts"].items():
        largest = max((v for v in kept["values"] if v is not None), default=-inf)
        if largest > kept["worst"] + ROUNDING * abs(largest):
            yield f"the layout '{name}' reached {largest:.6g} where its worst is called {kept['worst']:.6g}"
    own = document["layouts"][document["robust"]]["worst"]
    if not isclose(own, document["worst"], rel_tol=ROUNDING):
        yield f"its layout '{document['robust']}' has a worst case of {own:.6g} in the table"


def against_search(part: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against the numbers of one worst case beside its runs and the gaps stated on the way."""
    sign = 1.0 if part["sense"] == "max" else -1.0
    history = part["history"]
    made = sum(run["iteration"] > 0 for run in history)
    if made != part["evaluations"]:
        yield f"{part['evaluations']} runs are said to have been made where {made} are listed"
    lost: dict[str, int] = {}
    for run in history:
        if run["value"] is None:
            lost[run["status"]] = lost.get(run["status"], 0) + 1
    if lost != part["failures"]:
        yield f"its runs without a value are {part['failures']} and the list has {lost}"
    is_mean = part.get("mean") is not None
    if part["confirmed"] and not is_mean:
        own = [run["value"] for run in history if run["run_key"] == part["run_key"]]
        if not any(v is not None and abs(v - part["value"]) <= ROUNDING * abs(v) for v in own):
            yield "no run of that key and value is listed"
    if is_mean and not part["interval"][0] <= part["mean"] <= part["interval"][1]:
        yield "its mean lies outside of its interval"
    looks, gap = list(part.get("gap_history") or []), part.get("gap") or {}
    for look in [] if is_mean else looks:
        then = [run["best"] for run in history[: look["runs"]] if run["best"] is not None]
        if then and sign * (look["upper"] - then[-1]) < -ROUNDING * abs(then[-1]):
            yield f"after {look['runs']} runs the bound {look['upper']:.6g} stood below a run, {then[-1]:.6g}"
    if len(looks) > 1 and gap.get("upper") is not None and looks[-1]["upper"] != gap["upper"]:
        yield f"its gaps end at the bound {looks[-1]['upper']:.6g} and {gap['upper']:.6g} is stated"


def _quantile(ordered: Sequence[float], share: float) -> float:
    """The quantile of ordered values between the two that are nearest to it in rank."""
    place = share * (len(ordered) - 1)
    low = int(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (place - low) * (ordered[high] - ordered[low])


def _differing(made: Mapping[str, tuple[float, float]], size: float) -> Iterator[str]:
    """The numbers (said, made again) that differ by more than rounding of values of a size."""
    for name, (said, again) in made.items():
        if not abs(said - again) <= ROUNDING * max(size, abs(again)):
            yield f"its {name} is said to be {said:.6g} where its values make {again:.6g}"

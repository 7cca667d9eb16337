"""What a stage is about to claim, and the checker that refuses a contradiction before anything is written.

A claim is a typed record: a worst value with its sense, what stands behind it, and the bound that goes with
it. Refused are

    a worst value that a known run, of the store or of a table, goes beyond
    a bound on the wrong side of its value
    a loop called closed whose own record of runs goes beyond its tolerance
    a green verdict with reasons against it
    a result that loses to a layout it was compared with
    a worst value called attacked that its own attack went beyond, or did not test as the grade asks
    a counted share whose interval is not that of its own numerator and denominator
    a prediction where the model could have been run
    a loop called closed, or green, that a sample of the uncertainty broke
    a green verdict over an optimiser at its limit, over disagreeing starts or none
    a worst scenario of a design that its own runs go beyond, or a share that they do not make
    a mean, quantile, regret, gap or count that is not that of the values beside it (`recounts`)

The colours of the answers on the page are checked by `workbench.report.sections.green_answers`.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.errors import Contradiction
from workbench.report.lines.tables import unit_suffix
from workbench.report.recounts import against_rounds, against_search, against_summary
from workbench.search.evidence.attack.share import counted_share
from workbench.search.evidence.grade import ARRIVED
from workbench.space.units import significant, told_apart

__all__ = [
    "Claim",
    "Contradiction",
    "known_values",
    "refuse_contradictions",
    "robust_claims",
    "robust_layout_claims",
    "worst_case_claims",
]

ROUNDING = 1e-9  # of the value: what a sum in another order may change


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One worst value.

    subject: what is claimed, as the message names it.    sense: "max" when large is bad.
    kind: "run", "prediction", or "mean" of repeated runs, which single ones may go beyond.
      bound: the value that it is said not to exceed, None without one.
    against: reasons that speak against what is said, empty where nothing does.
    """

    subject: str
    value: float
    unit: str
    sense: str
    kind: str
    run_key: str = ""
    bound: float | None = None
    against: Sequence[str] = ()

    def beyond(self, other: float) -> float:
        """By how much another value is worse, less rounding; 0 or less where it is not."""
        sign = 1.0 if self.sense == "max" else -1.0
        return sign * (other - self.value) - ROUNDING * max(abs(other), abs(self.value))


def worst_case_claims(document: Mapping[str, Any], *, is_runnable: bool) -> list[Claim]:
    """The claims of `worst_case.json`: of its response and of the `others`, in that order.

    is_runnable: the model can be run, so a prediction has no place; it is not where a table is all there is.
    """
    found = []
    for part in (document, *document.get("others", ())):
        found.append(
            Claim(
                subject=f"the worst case of {part['response']}",
                value=float(part["value"]),
                unit=str(part.get("unit") or "1"),
                sense=part["sense"],
                kind="mean" if part.get("mean") is not None else "run" if part["confirmed"] else "prediction",
                run_key=str(part.get("run_key") or ""),
                bound=(part.get("gap") or {}).get("upper"),  # of a smallest value the lower one
                against=(
                    *_against_prediction(part, is_runnable=is_runnable),
                    *_against_grade(part),
                    *_against_shares(part),
                    *against_search(part),
                ),
            )
        )
    return found


def _against_prediction(part: Mapping[str, Any], *, is_runnable: bool) -> Iterator[str]:
    """What speaks against a worst value without a run."""
    if part["confirmed"]:
        return
    if is_runnable:
        yield "the model can be run there, and was not"
    elif part.get("grade") == "attacked":
        yield "it is called attacked without a run"


def _against_grade(part: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against a worst value being called attacked."""
    attack = part.get("attack")
    if part.get("grade") != "attacked":
        return
    if attack is None or not attack["runs"]:
        yield "it is called attacked without a run of an attack"
    elif attack["excess"] > ROUNDING * abs(part["value"]) and part.get("mean") is None:
        yield f"it is called attacked although its attack found {attack['largest']:.6g}"
    elif attack["arrived"] < ARRIVED:
        yield f"it is called attacked although {attack['arrived']} of {attack['climbs']} climbs arrived there"


def _against_shares(document: Any, name: str = "") -> Iterator[str]:
    """Counted shares anywhere in a document whose interval is not that of their counts."""
    if not isinstance(document, Mapping):
        return
    if {"hits", "draws", "low", "high"} <= document.keys():
        counted = counted_share(document["hits"], document["draws"])
        if max(abs(counted.low - document["low"]), abs(counted.high - document["high"])) > ROUNDING:
            yield (
                f"its {name} says {document['low']:.3g} to {document['high']:.3g} where {counted.hits} of "
                f"{counted.draws} make {counted.low:.3g} to {counted.high:.3g}"
            )
    for key, part in document.items():
        yield from _against_shares(part, f"{name} {key}".strip())


def robust_claims(document: Mapping[str, Any]) -> list[Claim]:
    """The claims of `robust.json`: the worst run of each design, in the order of `summaries`; against them
    speaks whatever else its values do not make.
    """
    found = []
    for summary in document["summaries"]:
        name = summary["design"]
        found.append(
            Claim(
                subject=f"the worst run of the design '{name}'",
                value=float(summary["worst_run"]),
                unit=str(document["unit"]),
                sense=document["sense"],
                kind="run",
                against=(*_against_beyond(document, summary), *against_summary(document, summary)),
            )
        )
    return found


def _against_beyond(document: Mapping[str, Any], summary: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against the share of the drawn scenarios beyond the limit: the values themselves."""
    said, limit = summary["beyond_limit"], document["limit"]
    if said is None:
        return
    sign = 1.0 if document["sense"] == "max" else -1.0
    drawn = [row[: document["drawn"]] for row in document["values"].values()]
    whole = [k for k, row in enumerate(zip(*drawn, strict=True)) if None not in row]
    own = document["values"][summary["design"]]
    beyond = sum(sign * own[k] > sign * limit for k in whole)
    if abs(said[0] * len(whole) - beyond) > ROUNDING * len(whole):
        yield f"{100 * said[0]:.3g} % are said to lie beyond {limit:.6g} where {beyond} of {len(whole)} do"
    elif not said[1] - ROUNDING <= said[0] <= said[2] + ROUNDING:
        yield f"its share {said[0]:.3g} lies outside of its interval {said[1]:.3g} to {said[2]:.3g}"


def known_values(document: Mapping[str, Any], design: str) -> list[tuple[str, float]]:
    """Every value of a design in `robust.json`, with the scenario's number for a key."""
    return [(f"in scenario {k + 1}", v) for k, v in enumerate(document["values"][design]) if v is not None]


def robust_layout_claims(document: Mapping[str, Any]) -> list[Claim]:
    """The claim of `robust_layout.json`."""
    against = []
    attack, tolerance = document["attack"], document["tolerance"]
    limit = document["bound"] + tolerance * abs(document["bound"])
    if document["closed"] and (attack is None or document["worst"] > limit + ROUNDING * abs(limit)):
        against.append("it is called closed without an attack that it withstood")
    if document["closed"] and document["broken_by_samples"]:
        against.append("it is called closed although a sample of the uncertainty lies beyond its bound")
    if document["verdict"] == "green":
        against.extend(f"its verdict is green although {why}" for why in _against_green(document))
    withstood = attack is not None and document["worst"] <= limit
    slack = 0.5 * tolerance if withstood else ROUNDING  # what withstood an attack is not left for less
    for name, kept in document["layouts"].items():
        lowest = max((v for v in kept["values"] if v is not None), default=float("inf"))
        if lowest < document["bound"] - slack * abs(document["bound"]):
            against.append(f"the layout '{name}' is better over the cases known, {lowest:.6g}")
    against.extend(_against_shares(attack, "attack"))
    against.extend(against_rounds(document))
    return [
        Claim(
            subject="the worst case of the robust layout", value=float(document["worst"]),
            unit=str(document["unit"]), sense="max", kind="run", against=tuple(against),
        )
    ]  # fmt: skip


def _against_green(document: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against a green verdict of a robust loop, by its own records."""
    yield from document["reasons"]
    others, tolerance = document["other_starts"], document["tolerance"]
    if not document["closed"]:
        yield "its loop is not closed"
    if others is None:
        yield "no other start was tried"
    elif not others["agrees"] or others["apart"] > tolerance * (1 + ROUNDING):
        yield f"other starts came no nearer to it than {100 * others['apart']:.3g} %"
    ended = document["optimiser"]
    if ended is not None and (ended["kkt"] is None or ended["kkt"] > ended["allowed"]):
        how = "ended" if ended["converged"] else "stopped at its limit"
        yield f"its optimiser {how} before the first-order condition held"


def refuse_contradictions(claim: Claim, known: Iterable[tuple[str, float]]) -> None:
    """Check a claim against itself and the known runs, (key, value) each.

    Raises:
        Contradiction: the first that is found, with both values.
    """
    unit = unit_suffix(claim.unit)

    def said(value: str) -> str:
        return f"{claim.subject}, {value}{unit} by a {claim.kind}, is not written:"

    if claim.against:
        raise Contradiction(f"{said(significant(claim.value))} {claim.against[0]}")
    if claim.bound is not None and claim.beyond(claim.bound) < -2 * ROUNDING * abs(claim.value):
        value, bound = told_apart(claim.value, claim.bound)
        raise Contradiction(f"{said(value)} its bound {bound} lies on the wrong side of it")
    if claim.kind == "mean":
        return
    worst = max(known, key=lambda run: claim.beyond(run[1]), default=None)
    if worst is not None and claim.beyond(worst[1]) > 0:
        value, known_value = told_apart(claim.value, worst[1])
        raise Contradiction(
            f"{said(value)} the known run {worst[0]} gave {known_value}{unit}. Please report this with the "
            "campaign's folder"
        )

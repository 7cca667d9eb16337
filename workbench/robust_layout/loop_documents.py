"""The documents of a robust loop: `robust_layout.json`, `layout.json` of its best layout, `motion.json`."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from workbench.engine.errors import EngineError
from workbench.engine.layout.outcome.purify import fractional_members
from workbench.models.evaluator import Outcome
from workbench.motion.frames import Motion, side_by_side
from workbench.robust.re_evaluation import ReEvaluation
from workbench.robust_layout.cases import TRIVIAL
from workbench.robust_layout.document import finite, layout_members
from workbench.robust_layout.model import LayoutModel
from workbench.robust_layout.record import FIRST_ORDER, RobustLayout, excess, promise_of
from workbench.search.evidence.attack.share import counted_share
from workbench.space.units import number

__all__ = [
    "COMPARED", "best_layout_document", "loop_document", "over_all_cases", "requirement_documents",
    "response_slope", "shown_cases", "shown_motion", "shown_name",
]  # fmt: skip

NOTICED = 1e-3  # of the value: a smaller rise by later cases is not worth a sentence
OF_THE_SEARCH = "What follows is of the search over the cases known then."
COMPARED = ("nominal only", "uniform")  # who is not restrained flies, and would squeeze every figure
RANKS = ("worst", "second worst", "third worst", "fourth worst")
SHOWN = 3  # cases of the layout returned, at most


def loop_document(
    model: LayoutModel, found: RobustLayout, compared: ReEvaluation, table: Mapping[str, Any]
) -> dict[str, Any]:
    """`robust_layout.json`: rounds, cases and layouts in plain numbers and sentences, no NaN.

    Args:
        compared: the layouts over the samples of the uncertainty.    table: `[robust_layout]` of the study.
    """
    named = _names(found)
    return {
        "title": model.title,
        "response": model.response,
        "unit": model.unit,
        "robust": shown_name(found),
        "made_as": found.robust,
        "closed": found.closed,
        "grade": found.grade,
        "worst": found.worst[found.robust].value,
        "may_exceed": finite(found.may_exceed),  # None: attacks were too short to say
        "attack": found.worst[found.robust].attack,
        "disbelieved": [dict(case) for case in found.worst[found.robust].disbelieved],
        "verdict": "green" if not found.reasons else "amber",
        "reasons": found.reasons,
        "status": found.status,
        "tolerance": table["tolerance"],
        "bound": found.bound,
        "rounds": [_plain(asdict(r)) for r in found.rounds],
        "cases": found.cases,
        "layouts": {
            shown: {
                "worst": found.worst[name].value,
                "case": dict(found.worst[name].case),
                "runs": found.worst[name].runs,
                "search": found.worst[name].status,
                "nominal": found.values[name][0],
                "values": found.values[name],
                "density": found.layouts[name].tolist(),
            }
            for shown, name in named.items()
        },
        "optimiser": None
        if not found.document
        else {
            "converged": bool(found.document["converged"]),
            "kkt": found.document["kkt"],
            "allowed": FIRST_ORDER,
        },
        "failures": found.failures,
        "samples": len(compared.values) - len(found.cases),
        "other_starts": None
        if found.other_starts is None
        else {
            **_plain(asdict(found.other_starts)),
            "starts": list(found.other_starts.starts),
        },
    }


def requirement_documents(
    required: Mapping[str, Sequence[float | None]],
    found: RobustLayout,
    outcomes: Mapping[str, Sequence[Outcome]],
    *,
    response: str,
    units: Mapping[str, str],
) -> list[dict[str, Any]]:
    """Whether the robust layout keeps responses between what is required; a run that failed does not.

    Args:
        required: response -> low and high, None for an open side.
        outcomes: true runs of the robust layout in the cases "found" for any layout, and "sampled".
        response: the one that was attacked; of another nobody looked for the worst.
    """
    documents = []
    for name, (low, high) in required.items():
        held = {key: _held(name, low, high, runs) for key, runs in outcomes.items()}
        share = counted_share(held["sampled"]["within"], held["sampled"]["runs"])
        held["sampled"]["share"] = [share.low, share.high]
        documents.append(
            {
                "response": name, "unit": units[name], "low": low, "high": high,
                "met": all(part["within"] == part["runs"] for part in held.values()),
                "grade": found.grade if name == response else "sampled",
                "may_reach": finite(_may_reach(found)) if name == response and not found.closed else None,
                "attack_runs": _attack_runs(found) if name == response else None,
                **held,
            }
        )  # fmt: skip
    return documents


def _may_reach(found: RobustLayout) -> float:
    """Where another attack may find the attacked response of a loop that is not closed; infinity where
    attacks were too short to say."""
    worst = found.worst[found.robust].value
    return worst + found.may_exceed * abs(worst)


def _attack_runs(found: RobustLayout) -> int:
    """True runs of the adversary that attacked the layout returned, 0 where none did."""
    attack = found.worst[found.robust].attack
    return 0 if attack is None else int(attack["runs"])


def _held(name: str, low: float | None, high: float | None, runs: Sequence[Outcome]) -> dict[str, Any]:
    values = [run.outputs.get(name) for run in runs]
    told = [value for value in values if value is not None]
    kept = [
        value is not None and (low is None or value >= low) and (high is None or value <= high)
        for value in values
    ]
    broken = next((dict(run.parameters) for run, stays in zip(runs, kept, strict=True) if not stays), None)
    return {
        "runs": len(runs), "within": sum(kept), "case": broken,
        "low": min(told, default=None), "high": max(told, default=None),
    }  # fmt: skip


def best_layout_document(model: LayoutModel, found: RobustLayout) -> dict[str, Any]:
    """`layout.json`: the robust layout in the response's terms, judged by true runs in all cases found."""
    density, source = found.layouts[found.robust], dict(found.document)
    if not source:  # a trivial layout won
        source = {"history": [], "shadow_prices": {}, "verdicts": []}
    problem = model.problem(found.cases[:1])
    used = zip(problem.names, problem.limits, problem.costs @ density, strict=True)
    value = float(source.get("value", 0.0))
    slope = response_slope(model, value)
    drawing, places = getattr(model, "outlines", None), getattr(model, "places", None)
    purified = source.get("purified")
    optimum = model.as_response(value) if source["history"] else found.bound
    return {
        **source,
        **over_all_cases(source, optimum=optimum, bound=found.bound, unit=model.unit),
        "response": model.response,
        "unit": model.unit,
        "title": model.title,
        "trivial": found.robust if found.robust in TRIVIAL else None,
        "value": found.bound,
        "start_value": model.as_response(float(source.get("start_value", 0.0))),
        "density": density.tolist(),
        "fractional": fractional_members(problem, density),
        "budgets": [{"name": n, "limit": float(limit), "used": float(u)} for n, limit, u in used],
        "members": layout_members(problem, density),
        "outlines": [] if drawing is None else drawing(),
        "matrix": None if places is None else dict(
            zip(("rows", "columns", "cells"), places(), strict=True)
        ),
        "history": [
            {
                **h,
                **{key: None if h[key] is None else model.as_response(h[key]) for key in ("value", "best")},
            }
            for h in source["history"]
        ],
        "shadow_prices": {name: price * slope for name, price in source["shadow_prices"].items()},
        "baselines": {name: found.worst[name].value for name in COMPARED if name in found.worst},
        "scenarios": [
            {"name": f"case {k + 1}", "value": value, "parameters": dict(case)}
            for k, (case, value) in enumerate(zip(found.cases, found.values[found.robust], strict=True))
        ],
        "purified": None if purified is None else {
            **purified, "value": model.as_response(purified["value"]),
            "before": model.as_response(purified["before"]),
        },
    }  # fmt: skip


def over_all_cases(source: Mapping[str, Any], *, optimum: float, bound: float, unit: str) -> dict[str, Any]:
    """What a search says of its layout, told of the cases that were known then where others have joined, or
    where a search that went on from it knows better.

    optimum: over the cases known then.    bound: over all that were found.    The document's kkt is of these.
    """
    has_joined, went_on = excess(bound, optimum) > NOTICED, source.get("went_on")
    if not has_joined and went_on is None:
        return {}
    left = f"{100 * promise_of(source):.2g} % may be left to gain, to first order."
    said = [source["status"]]
    if has_joined:
        over_all = f"over all that were found {number(bound, 4)} {unit}"
        end = f", of which {left}" if went_on is None else "."
        said.append(f"Over the cases known then it has {number(optimum, 4)} {unit}, {over_all}{end}")
    if went_on is not None:
        said.append(
            f"A search that went on from it came to {number(went_on['value'], 4)} {unit} over the cases "
            f"known to it, and promised {100 * promise_of(went_on):.2g} % more: "
            f"of {number(bound, 4)} {unit} {left}"
        )
    return {"status": " ".join(said), "verdicts": [OF_THE_SEARCH, *source["verdicts"]]}


def response_slope(model: LayoutModel, value: float) -> float:
    """By how much the response changes per unit of the problem's objective, at this value of it."""
    if not value:
        return 1.0
    return (model.as_response(value * 1.001) - model.as_response(value)) / (1e-3 * value)


def shown_name(found: RobustLayout) -> str:
    """What the layout returned is called wherever it is shown: "robust", or its name where it is trivial."""
    return found.robust if found.robust in TRIVIAL else "robust"


def _names(found: RobustLayout) -> dict[str, str]:
    """Shown name -> name in the loop: the trivial layouts, every one that was made, the one returned."""
    out = {name: name for name in found.layouts if name != found.robust or name in TRIVIAL}
    return {**out, shown_name(found): found.robust}


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    return {k: (finite(v) if isinstance(v, float) else v) for k, v in record.items()}


def shown_cases(found: RobustLayout) -> dict[str, dict[str, Any]]:
    """Cases by name: the worst of the nominal-only layout, the three worst of the robust one, the nominal."""
    cases = {"the worst case of 'nominal only'": dict(found.worst["nominal only"].case)}
    worst, shown = found.worst[found.robust], shown_name(found)
    of = "the robust layout" if shown == "robust" else f"'{shown}'"
    known = [worst.case, *(other["case"] for other in worst.others)]
    ranked = [(rank, dict(case)) for rank, case in zip(RANKS, known, strict=False)]
    fresh = [(rank, case) for rank, case in ranked if case not in cases.values()][:SHOWN]
    cases |= {f"the {rank} case of {of}": case for rank, case in fresh}
    if dict(found.cases[0]) not in cases.values():
        cases["the nominal case"] = dict(found.cases[0])
    return cases


def shown_motion(
    model: LayoutModel, found: RobustLayout, cases: Mapping[str, Mapping[str, Any]]
) -> Motion | None:
    """No members, the nominal-only and the layout returned side by side in every case.

    None for a model that makes no motion. A case that cannot be run without members is shown with them alone.
    """
    make = getattr(model, "motion", None)
    if make is None:
        return None
    held = {name: found.layouts[name] for name in ("nominal only", found.robust) if name != "none"}
    held = {shown_name(found) if name == found.robust else name: a for name, a in held.items()}

    def motion(case: Mapping[str, Any]) -> Motion:
        try:
            together: Motion = make({"without": found.layouts["none"], **held}, case)
        except (EngineError, ArithmeticError, ValueError):
            together = make(held, case)
        return together

    return side_by_side({name: motion(case) for name, case in cases.items()})

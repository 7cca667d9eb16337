"""The stage `robust_layout` of a study: the robust loop, what it is worth, and the documents of the report.

Writes, in this order: `layout.json` (the robust layout), `robust.json` (layouts beside each other at the same
points of the uncertainty), `screening_after.json` (which parameters matter once it is in), `motion.json` (the
nominal-only and the robust layout in the worst case of the former) and `robust_layout.json` with the rest.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.campaign.runs import CampaignRuns
from workbench.engine.layout.outcome.purify import fractional_members
from workbench.errors import HoldfastError, NotEnoughRuns, StudyError
from workbench.models.protocol import ModelSpec
from workbench.models.python import source_digest
from workbench.robust.re_evaluation import ReEvaluation, re_evaluate
from workbench.robust_layout.cases import Optimised, optimise_for_cases
from workbench.robust_layout.loop import (
    NEAR,
    SECOND,
    LoopSettings,
    RobustLayout,
    find_robust_layout,
)
from workbench.robust_layout.model import LayoutModel, load_layout_model
from workbench.robust_layout.runs import LayoutRuns
from workbench.system.atomic import read_json, write_json

__all__ = ["model_identity", "run_robust_layout"]

Array = NDArray[np.float64]

RESTARTS = 2  # times that a sample beyond the bound sends the loop back
COMPARED = ("nominal only", "uniform")  # who is not restrained flies, and would squeeze every figure
_TRIVIAL = ("none", "uniform", "nominal only")


def run_robust_layout(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """Run the loop of `[robust_layout]`; returns `robust_layout.json`. Run again to continue.

    Raises StudyError for an unusable model or nominal case, Interrupted when the user stops it.
    """
    study = campaign.study
    model = load_layout_model(table["model"], table["options"], folder=study.folder)
    study.response(model.response)  # refuses a response that the study does not have
    identity = model_identity(campaign, table)
    settings = LoopSettings(
        evaluations=table["evaluations"], budget=table["budget"], corners=table["corners"],
        rounds=table["rounds"], tolerance=table["tolerance"], seed=study.seed,
    )  # fmt: skip
    nominal = study.space.canonical(table["nominal"])
    start = [nominal, *_worst_case(campaign, table)]
    options = study.evaluate
    with LayoutRuns(
        campaign.folder,
        spec=_spec(campaign, table, identity),
        space=study.space,
        model=model,
        seed=study.seed,
        inline=options.get("engine") == "inline",
        workers=options.get("workers", 1),
        timeout=options.get("timeout"),
        memory=study.memory_bytes,
        retries=options.get("retries", 0),
    ) as runs:
        found, rounds = None, []
        for _ in range(1 + RESTARTS):
            found = find_robust_layout(
                model, study.space, evaluator=runs.of, folder=campaign.folder, start=start, settings=settings,
                identity=identity, tell=lambda text: campaign.progress.stage("robust_layout", text),
            )  # fmt: skip
            rounds += found.rounds
            campaign.progress.stage("robust_layout", f"{table['samples']} samples of the uncertainty")
            compared = _compared(campaign, table, model, found, runs, nominal)
            broken = _broken(compared, found, settings.tolerance)
            if broken is None:
                break
            start = [*found.cases, broken]
        assert found is not None
        found.rounds = rounds
        write_json(campaign.folder / "layout.json", _layout_document(model, found))
        write_json(campaign.folder / "robust.json", {**compared.to_dict(), "response": model.response})
        screened = _screened(campaign, model, found, runs)
        variants = [_variant(campaign, table, v, found, identity) for v in table["variant"]]
        moved = _motion(campaign, model, found)
        document = {
            **_document(model, found, compared, table),
            "screening": screened,
            "second_start": _second_start(found, settings.tolerance),
            "variants": variants,
            "motion_case": moved,
            "runs": runs.counts(),
            "broken_by_samples": broken is not None,
        }
    write_json(campaign.folder / "robust_layout.json", document)
    return document


def model_identity(campaign: CampaignRuns, table: Mapping[str, Any]) -> str:
    """What makes a run of the layout model what it is: function, its source, options, version."""
    digest = source_digest(table["model"], campaign.study.folder)
    return json.dumps([table["model"], digest, dict(table["options"]), campaign.spec.version], sort_keys=True)


def _spec(campaign: CampaignRuns, table: Mapping[str, Any], identity: str) -> ModelSpec:
    study = campaign.study
    return ModelSpec(
        kind="layout",
        options={
            "model": table["model"], "options": dict(table["options"]),
            "layouts": str((campaign.folder / "layouts").resolve()),
        },
        folder=str(study.folder.resolve()),
        names=study.space.names,
        responses={response.name: None for response in study.responses},
        identity=identity,
        version=campaign.spec.version,
    )  # fmt: skip


def _worst_case(campaign: CampaignRuns, table: Mapping[str, Any]) -> list[dict[str, Any]]:
    if table["start"] != "worst_case":
        return []
    found = read_json(campaign.folder / "worst_case.json")
    if found is None:
        raise StudyError(
            "[robust_layout] start = 'worst_case' needs a worst case; give the study a [worst_case] table"
        )
    return [dict(found["parameters"])]


def _compared(
    campaign: CampaignRuns, table: Mapping[str, Any], model: LayoutModel, found: RobustLayout,
    runs: LayoutRuns, nominal: Mapping[str, Any],
) -> ReEvaluation:  # fmt: skip
    """Baselines first, the robust layout last, all at the same points."""
    names = [name for name in COMPARED if name != found.robust]
    layouts = {**{name: found.layouts[name] for name in names}, "robust": found.layouts[found.robust]}
    return re_evaluate(
        lambda design, u: None,
        {name: {} for name in layouts},
        campaign.study.space,
        response=model.response,
        unit=model.unit,
        samples=table["samples"],
        seed=campaign.study.seed,
        limit=table.get("limit"),
        nominal=nominal,
        extra_scenarios=found.cases,
        evaluators={name: runs.of(density) for name, density in layouts.items()},
    )


def _broken(compared: ReEvaluation, found: RobustLayout, tolerance: float) -> dict[str, Any] | None:
    """A sampled case that is worse for the robust layout than the bound allows, also where others fail."""
    summary = compared.summaries[-1]
    known = found.worst[found.robust].value
    return dict(summary.worst_run_scenario) if summary.worst_run > known * (1 + tolerance) else None


def _document(
    model: LayoutModel, found: RobustLayout, compared: ReEvaluation, table: Mapping[str, Any]
) -> dict[str, Any]:
    """Plain numbers and sentences, no NaN."""
    named = _names(found)
    return {
        "title": model.title,
        "response": model.response,
        "unit": model.unit,
        "robust": "robust" if found.robust not in _TRIVIAL else found.robust,
        "certified": found.certified,
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
                "open_gap": found.worst[name].open_gap,
                "nominal": found.values[name][0],
                "values": found.values[name],
            }
            for shown, name in named.items()
        },
        "failures": found.failures,
        "samples": len(compared.values) - len(found.cases),
    }


def _second_start(found: RobustLayout, tolerance: float) -> dict[str, Any] | None:
    """The worst of the layout from another start in all cases, and whether it agrees."""
    if SECOND not in found.values or found.robust == SECOND:
        others = [k for k in found.values if k.startswith("round")]
        other = min((_largest(found.values[k]) for k in others), default=None)
    else:
        other = _largest(found.values[SECOND])
    if other is None:
        return None
    return {"worst": other, "agrees": bool(abs(other - found.bound) <= tolerance * found.bound)}


def _largest(values: list[float | None]) -> float:
    return max((v for v in values if v is not None), default=float("inf"))


def _names(found: RobustLayout) -> dict[str, str]:
    """Shown name -> name in the loop: the trivial layouts, the nominal-only one, the robust one."""
    out: dict[str, str] = {name: name for name in _TRIVIAL if name in found.layouts}
    if found.robust not in out:
        out["robust"] = found.robust
    return out


def _layout_document(model: LayoutModel, found: RobustLayout) -> dict[str, Any]:
    """`layout.json`: the robust layout in the response's terms, judged by true runs in all cases found."""
    density, source = found.layouts[found.robust], dict(found.document)
    if not source:  # a trivial layout won
        source = {"history": [], "members": [], "shadow_prices": {}, "verdicts": []}
    problem = model.problem(found.cases[:1])
    used = zip(problem.names, problem.limits, problem.costs @ density, strict=True)
    value = float(source.get("value", 0.0))
    slope = (model.as_response(value * 1.001) - model.as_response(value)) / (1e-3 * value) if value else 1.0
    counts: dict[str, int] = {}
    members = []
    for member, there in zip(source["members"], density, strict=False):
        counts[member["kind"]] = counts.get(member["kind"], 0) + 1
        members.append(
            {**member, "density": float(there), "name": f"{member['kind']} {counts[member['kind']]}"}
        )
    drawing, places = getattr(model, "outlines", None), getattr(model, "places", None)
    purified = source.get("purified")
    return {
        **source,
        "response": model.response,
        "unit": model.unit,
        "title": model.title,
        "value": found.bound,
        "start_value": model.as_response(float(source.get("start_value", 0.0))),
        "density": density.tolist(),
        "fractional": fractional_members(problem, density),
        "budgets": [{"name": n, "limit": float(limit), "used": float(u)} for n, limit, u in used],
        "members": members,
        "outlines": [] if drawing is None else drawing(),
        "matrix": None if places is None else dict(
            zip(("rows", "columns", "cells"), places(), strict=True)
        ),
        "history": [
            {
                **h, "value": model.as_response(h["value"]),
                "best": None if h["best"] is None else model.as_response(h["best"]),
            }
            for h in source["history"]
        ],
        "shadow_prices": {name: price * slope for name, price in source["shadow_prices"].items()},
        "baselines": {name: found.worst[name].value for name in COMPARED if name in found.worst},
        "scenarios": [
            {"name": f"case {k + 1}", "value": value, "parameters": _apart(case, found.cases[0])}
            for k, (case, value) in enumerate(zip(found.cases, found.values[found.robust], strict=True))
        ],
        "purified": None if purified is None else {
            **purified, "value": model.as_response(purified["value"]),
            "before": model.as_response(purified["before"]),
        },
    }  # fmt: skip


def _apart(case: Mapping[str, Any], nominal: Mapping[str, Any]) -> dict[str, Any]:
    """Where a case differs from the nominal one; all of the nominal one itself."""
    apart = {name: value for name, value in case.items() if value != nominal[name]}
    return apart or dict(case)


def _screened(
    campaign: CampaignRuns, model: LayoutModel, found: RobustLayout, runs: LayoutRuns
) -> dict[str, Any] | None:
    """The study's own screening runs repeated with the robust layout, and what changed.

    Without a transform: a layout that holds leaves a smooth response, on which ranks tell less.
    """
    study = campaign.study
    design, before = (read_json(campaign.folder / f"{name}.json") for name in ("design", "screening"))
    if study.screen is None or design is None or before is None:
        return None
    from workbench.screening.screen import screen

    rows = [dict(zip(study.space.names, point, strict=True)) for point in design["physical"]]
    campaign.progress.stage("robust_layout", f"screening of the robust layout on {len(rows)} runs")
    try:
        after = screen(
            runs.of(found.layouts[found.robust])(rows, purpose="screening"), study.space,
            study.response(model.response), method=study.screen["method"], seed=study.seed,
        ).to_dict()  # fmt: skip
    except (NotEnoughRuns, StudyError) as error:
        return {"before": list(before["selected"]), "after": None, "reason": str(error)}
    write_json(campaign.folder / "screening_after.json", after)
    old, new = list(before["selected"]), list(after["selected"])
    return {
        "before": old,
        "after": new,
        "gained": [name for name in new if name not in old],
        "lost": [name for name in old if name not in new],
        "verdict": after["verdict"],
        "q2": (after["leave_one_out"] or {}).get("q2"),
    }


def _variant(
    campaign: CampaignRuns,
    table: Mapping[str, Any],
    variant: Mapping[str, Any],
    found: RobustLayout,
    identity: str,
) -> dict[str, Any]:
    """Another layout problem for the cases of the loop: optimised, judged in all cases, purified, priced."""
    name, options = variant["name"], {**table["options"], **variant["options"]}
    campaign.progress.stage("robust_layout", f"layout '{name}'")
    model = load_layout_model(table["model"], options, folder=campaign.study.folder)
    robust = found.layouts[found.robust]
    made = optimise_for_cases(
        model, _loop_cases(found), start=robust if model.members == len(robust) else None,
        folder=campaign.folder / "rounds",
        evaluations=table["evaluations"], identity=f"{identity} {json.dumps(options, sort_keys=True)}",
    )  # fmt: skip
    if isinstance(made, str):
        return {"name": name, "options": options, "failure": made}
    return {"name": name, "options": options, **_judged(model, made, found)}


def _judged(model: LayoutModel, made: Optimised, found: RobustLayout) -> dict[str, Any]:
    values: list[float | None] = []
    for case in found.cases:
        try:
            values.append(float(model.responses(made.density, case)[model.response]))
        except (HoldfastError, ArithmeticError, ValueError, RuntimeError):
            values.append(None)  # the case stays in the table, without a value
    document, clean = made.document, made.document.get("purified")
    value = float(document["value"])
    slope = (model.as_response(value * 1.001) - model.as_response(value)) / (1e-3 * value) if value else 1.0
    return {
        "worst": max((v for v in values if v is not None), default=None),
        "values": values,
        "status": document["status"],
        "evaluations": document["evaluations"],
        "budgets": document["budgets"],
        "shadow_prices": {name: price * slope for name, price in document["shadow_prices"].items()},
        "fractional": document["fractional"],
        "purified": None if clean is None else {
            "value": model.as_response(clean["value"]), "fractional": clean["fractional"],
            "loss": model.as_response(clean["value"]) / model.as_response(clean["before"]) - 1.0,
        },
    }  # fmt: skip


def _loop_cases(found: RobustLayout) -> list[dict[str, Any]]:
    """The cases in which the robust layout comes near its bound; the others cost time and change nothing."""
    values = found.values[found.robust]
    near = [c for c, v in zip(found.cases, values, strict=True) if v is None or v >= NEAR * found.bound]
    return near or found.cases[:1]


def _motion(campaign: CampaignRuns, model: LayoutModel, found: RobustLayout) -> dict[str, Any] | None:
    """`motion.json`: the nominal-only and the robust layout where the former is worst; None without one."""
    make = getattr(model, "motion", None)
    if make is None:
        return None
    case = dict(found.worst["nominal only"].case)
    layouts = {"nominal only": found.layouts["nominal only"], "robust": found.layouts[found.robust]}
    write_json(campaign.folder / "motion.json", make(layouts, case).to_dict())
    return case


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    return {k: (_finite(v) if isinstance(v, float) else v) for k, v in record.items()}

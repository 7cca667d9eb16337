"""The stage `robust_layout` of a study: the robust loop, what it is worth, and the documents of the report.

Writes, in this order: `bill_of_materials.json` and `.csv`, `layout.json` (the robust layout), `robust.json`
(layouts beside each other at the same points of the uncertainty), `screening_after.json` (which parameters
matter once it is in), `motion.json` (no members, the nominal-only and the robust layout in the cases worth
looking at) and `robust_layout.json` with the rest.
"""

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.engine.layout.formulation.problem import FAILURES
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.protocol import ModelSpec
from workbench.provenance.closure import digest_of_function
from workbench.report.claims import (
    known_values,
    refuse_contradictions,
    robust_claims,
    robust_layout_claims,
)
from workbench.report.lines.robust_layout import robust_layout_lines
from workbench.report.lines.statements import screening_state
from workbench.robust.re_evaluation import ReEvaluation, re_evaluate
from workbench.robust_layout.bill import robust_bill, write_bill
from workbench.robust_layout.loop import find_robust_layout
from workbench.robust_layout.loop_documents import (
    COMPARED,
    best_layout_document,
    loop_document,
    requirement_documents,
    shown_cases,
    shown_motion,
    shown_name,
)
from workbench.robust_layout.model import LayoutModel, load_layout_model, problem_of
from workbench.robust_layout.oracle import budget_for
from workbench.robust_layout.record import GOING_ON, LoopSettings, RobustLayout, excess
from workbench.robust_layout.runs import LayoutRuns
from workbench.robust_layout.variants import variant_document
from workbench.search.evidence.attack.share import at_most
from workbench.search.evidence.grade import BEYOND
from workbench.search.runs.unit_space import SearchSpace
from workbench.stages.work import Work
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.system.atomic import read_json, write_json

__all__ = ["WORK"]


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """Run the loop of `[robust_layout]`; returns `robust_layout.json`. Run again to continue.

    Raises StudyError for an unusable model or nominal case, Interrupted when the user stops it.
    """
    study = campaign.study
    model = _model(study, table["options"])
    identity = _model_identity(campaign, table)
    settings = LoopSettings(
        scenarios=table["scenarios"], evaluations=table["evaluations"], budget=table["budget"],
        corners=table["corners"], rounds=table["rounds"], tolerance=table["tolerance"], seed=study.seed,
        scouts=table.get("scouts"), joining=table["joining"],
    )  # fmt: skip
    nominal = study.space.canonical(table["nominal"])
    start = [nominal, *_worst_cases(campaign, table)]
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
        compared, broken = None, None

        def sampled(found: RobustLayout) -> Mapping[str, Any] | None:
            nonlocal compared, broken
            campaign.progress.stage("robust_layout", f"{table['samples']} samples of the uncertainty")
            compared = _compared(campaign, table, model, found, runs, nominal)
            broken = _broken(compared, found, settings.tolerance)
            return broken

        found = find_robust_layout(
            model, study.space, evaluator=runs.of, folder=campaign.folder, start=start, settings=settings,
            identity=identity, tell=lambda text: campaign.progress.stage("robust_layout", text),
            coarse=runs.coarse, broken=sampled,
        )  # fmt: skip
        assert compared is not None
        if broken is not None:
            found.broken_by(compared.summaries[-1].worst_run)
        bill = robust_bill(model, found.cases, found.layouts[found.robust])
        write_bill(campaign.folder, bill)
        write_json(campaign.folder / "layout.json", best_layout_document(model, found))
        beside = {**compared.to_dict(), "response": model.response}
        for claim, name in zip(robust_claims(beside), beside["designs"], strict=True):
            refuse_contradictions(claim, known_values(beside, name))
        write_json(campaign.folder / "robust.json", beside)
        screened = _screened(campaign, model, found, runs)
        variants = [_variant(campaign, table, v, found, identity) for v in table["variant"]]
        moved = _motion(campaign, model, found)
        document = {
            **loop_document(model, found, compared, table),
            "screening": screened,
            "variants": variants,
            "motion_case": moved,
            "requirements": _required(study, table, model, found, compared, runs),
            "runs": runs.counts(),
            "broken_by_samples": broken is not None,
        }
    for claim in robust_layout_claims(document):
        refuse_contradictions(claim, _known(document))
    write_json(campaign.folder / "robust_layout.json", document)
    return document


def _known(document: Mapping[str, Any]) -> list[tuple[str, float]]:
    """The robust layout's true runs in all cases, by the number of the case."""
    values = document["layouts"][document["robust"]]["values"]
    return [(f"in case {k}", v) for k, v in enumerate(values) if v is not None]


def _model_identity(campaign: StoredRuns, table: Mapping[str, Any]) -> str:
    """What makes a run of the layout model what it is: function, its code and what that imports and names of
    the user's own, options, version."""
    digest = digest_of_function(table["model"], campaign.study.folder)
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


def _worst_cases(campaign: CampaignRuns, table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The worst case found without restraints, when the table wants the loop to start with it."""
    found = _worst_case(campaign, table)
    if found is None and table["start"] == "worst_case":
        raise StudyError(
            "[robust_layout] start = 'worst_case' needs a worst case; give the study a [worst_case] table"
        )
    try:
        return [] if found is None else [campaign.study.space.canonical(found)]
    except StudyError as error:
        raise StudyError(
            f"the worst case that [robust_layout] starts with was found in another space: {error}. "
            "`holdfast run` looks for it anew"
        ) from error


def _worst_case(campaign: StoredRuns, table: Mapping[str, Any]) -> dict[str, Any] | None:
    wanted = table.get("start") == "worst_case"
    found = read_json(campaign.folder / "worst_case.json") if wanted else None
    return None if found is None else dict(found["parameters"])


def _compared(
    campaign: CampaignRuns, table: Mapping[str, Any], model: LayoutModel, found: RobustLayout,
    runs: LayoutRuns, nominal: Mapping[str, Any],
) -> ReEvaluation:  # fmt: skip
    """Baselines first, the layout returned last, all at the same points."""
    names = [name for name in COMPARED if name != found.robust]
    layouts = {name: found.layouts[name] for name in names}
    layouts[shown_name(found)] = found.layouts[found.robust]
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
    above = excess(summary.worst_run, found.worst[found.robust].value)
    return dict(summary.worst_run_scenario) if above > tolerance else None


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
    if before["response"] != model.response:  # what drives one response says nothing of another
        reason = f"it is of {before['response']}, and the layout is for {model.response}"
        return {"before": list(before["selected"]), "after": None, "reason": reason}
    from workbench.screening.kriging import screen

    rows = [dict(zip(study.space.names, point, strict=True)) for point in design["physical"]]
    campaign.progress.stage("robust_layout", f"screening of the layout returned on {len(rows)} runs")
    try:
        after = screen(
            runs.of(found.layouts[found.robust])(rows, purpose="screening"), study.space,
            study.response(model.response), method=study.screen["method"], transform="none", seed=study.seed,
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
        "state_before": screening_state(before),
        "state": after["state"],
        "verdict": after["verdict"],
        "q2": (after["leave_one_out"] or {}).get("q2"),
    }


def _required(
    study: Study, table: Mapping[str, Any], model: LayoutModel, found: RobustLayout, compared: ReEvaluation,
    runs: LayoutRuns,
) -> list[dict[str, Any]]:  # fmt: skip
    """What is required of the robust layout, held against its runs in the cases found and the samples."""
    required = table.get("required", {})
    if not required:
        return []
    evaluate, count = runs.of(found.layouts[found.robust]), len(compared.values) - len(found.cases)
    rows = {"found": found.cases, "sampled": compared.scenarios[:count]}
    return requirement_documents(
        required, found, {key: evaluate(some, purpose="cases") for key, some in rows.items()},
        response=model.response, units={response.name: response.unit for response in study.responses},
    )  # fmt: skip


def _variant(
    campaign: CampaignRuns,
    table: Mapping[str, Any],
    variant: Mapping[str, Any],
    found: RobustLayout,
    identity: str,
) -> dict[str, Any]:
    """Another layout problem for the cases of the loop."""
    name, options = variant["name"], {**table["options"], **variant["options"]}
    campaign.progress.stage("robust_layout", f"layout '{name}'")
    document = variant_document(
        _model(campaign.study, options), found,
        folder=campaign.folder / "rounds", evaluations=table["evaluations"],
        identity=f"{identity} {json.dumps(options, sort_keys=True)}",
    )  # fmt: skip
    return {"name": name, "options": options, **document}


def _motion(campaign: CampaignRuns, model: LayoutModel, found: RobustLayout) -> dict[str, Any] | None:
    """`motion.json`, where the model makes a motion; returns the case that is shown first."""
    cases = shown_cases(found)
    moved = shown_motion(model, found, cases)
    if moved is None:
        return None
    write_json(campaign.folder / "motion.json", moved.to_dict())
    return next(iter(cases.values()))


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> Iterable[str]:
    given = [_model_identity(campaign, table), _worst_case(campaign, table)]
    return [json.dumps(given, sort_keys=True)]


def _planned_runs(study: Study, folder: Path) -> int:
    table = study.robust_layout or {}
    looks = table["rounds"] + 2  # the two layouts compared; an attack where a look finds nothing
    attacks = table["rounds"] + GOING_ON  # one in each round, and the last may go on
    runs = looks * (table["corners"] + table["scenarios"]) + attacks * table["budget"]
    return int(runs + 3 * table["samples"])


def _model(study: Study, options: Mapping[str, Any]) -> LayoutModel:
    """The layout model with these options, for a response that the study has, in the study's unit.

    Raises StudyError.
    """
    reference = (study.robust_layout or {})["model"]
    model = load_layout_model(reference, options, folder=study.folder)
    known = {response.name: response.unit for response in study.responses}
    if model.response not in known:
        raise StudyError(
            f"the layout model '{reference}' is for the response {model.response!r}, which the study does "
            f"not have; its responses are {', '.join(known)}"
        )
    theirs, ours = (_plain_unit(unit) for unit in (model.unit, known[model.response]))
    if theirs != ours:
        raise StudyError(
            f"the layout model '{reference}' gives {model.response} in {model.unit!r}, the study's response "
            f"{model.response} is in {known[model.response]!r}. Give both in one unit"
        )
    return model


def _plain_unit(unit: str) -> str:
    """A unit without what only its spelling has: m/s^2 and m/s2 are one."""
    return unit.replace("^", "").replace(" ", "") or "1"


def _check(study: Study) -> None:
    """The layout model and those of the variants can be made, for a response of the study, and make problems
    of the nominal case and of every word that a parameter may have."""
    table = study.robust_layout or {}
    with placed(study.text, study.where, ("robust_layout", "model")):
        _makes_problems(study, _model(study, table["options"]))
    for k, variant in enumerate(table["variant"]):
        with placed(study.text, study.where, ("robust_layout", "variant", k, "options")):
            _makes_problems(study, _model(study, {**table["options"], **variant["options"]}))


def _makes_problems(study: Study, model: LayoutModel) -> None:
    """Raises StudyError where the model has no problem for the nominal case, or code of its own fails where
    one word or switch of that is another; an answer of the engine, that a case cannot be run, is none."""
    nominal = study.space.canonical((study.robust_layout or {})["nominal"])
    try:
        problem_of(model, [nominal])
    except FAILURES as error:
        raise StudyError(f"the layout model has no problem for the nominal case: {error}") from error
    for parameter in study.space.parameters:
        if parameter.kind not in ("categorical", "binary"):
            continue
        for level in parameter.levels or (0, 1):
            case = {**nominal, parameter.name: level}
            if level != nominal[parameter.name] and study.space.violated(case) is None:
                with suppress(*FAILURES):  # a case that cannot be run is one of many
                    problem_of(model, [case])


def _notes(study: Study) -> list[str]:
    """What is allowed and worth a word."""
    budget, needed = (study.robust_layout or {})["budget"], budget_for(BEYOND)
    if budget >= min(needed, SearchSpace.of(study.space).size):  # or runs all that there are
        return []
    return [
        f"[robust_layout] budget = {budget} is too short an attack to call the loop closed: that takes "
        f"{needed} true runs, which leave less than {at_most(BEYOND)} of the uncertainty beyond"
    ]


WORK = Work(
    run=_run, inputs=_inputs, lines=robust_layout_lines, planned_runs=_planned_runs, check=_check,
    notes=_notes,
)  # fmt: skip

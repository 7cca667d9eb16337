"""Functionals of histories among the outputs of runs: `[screen] response = "pc1 of force"` and the like.

Principal components are those of the runs of the design, and are not changed by what a search adds.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.histories.functionals import functional_values, share_of_mode
from workbench.models.evaluator import Outcome
from workbench.models.functionals import Functional
from workbench.models.stored.evaluation import Evaluation
from workbench.models.values import why_no_values
from workbench.system.atomic import read_json

__all__ = ["functional_notes", "has_functionals", "known_outcomes", "searching", "with_functionals"]


def has_functionals(campaign: StoredRuns, names: Iterable[str] = ()) -> bool:
    """Whether the study, or these `names`, read anything off histories that is no response."""
    return bool(_functionals(campaign, names))


def with_functionals(
    campaign: StoredRuns, rows: Sequence[Evaluation], names: Iterable[str] = ()
) -> list[Evaluation]:
    """The runs with what the study reads off their histories, and these `names`, among their outputs.

    A run whose history has no finite number there is one without a finite value.

    Raises:
        StudyError: runs have not kept the history.    NotEnoughRuns: the design has no such mode.
    """
    found = list(rows)
    for functional in _functionals(campaign, names):
        keys = [row.key for row in found if row.status == "ok"]
        if not keys:
            continue
        values = functional_values(campaign.folder, functional, keys, design=_design(campaign, functional))
        found = [_with_value(row, functional.name, values) for row in found]
    return found


def known_outcomes(campaign: StoredRuns) -> Iterator[Outcome]:
    """All runs of a campaign in the terms of a search, with functionals; without gradients where there are
    none of these. Of very many only some are held."""
    if has_functionals(campaign):
        yield from (row.as_outcome() for row in with_functionals(campaign, campaign.runs()))
        return
    for some in campaign.chunks():
        rows = zip(some.inputs, some.statuses, some.outputs, some.keys, some.errors, strict=True)
        for inputs, status, outputs, key, error in rows:
            yield Outcome(parameters=inputs, status=status, outputs=outputs, key=key, error=error)


def searching(campaign: CampaignRuns) -> Callable[..., list[Outcome]]:
    """What a search asks for runs: `evaluate` with functionals among the outputs."""

    def run(rows: Sequence[Mapping[str, Any]], *, purpose: str, repeat: int = 0) -> list[Outcome]:
        found = campaign.evaluate(rows, batch="worst_case", quiet=True, repeat=repeat)
        return [row.as_outcome() for row in with_functionals(campaign, found)]

    return run


def functional_notes(campaign: StoredRuns, names: Iterable[str]) -> dict[str, Any]:
    """For a document that is about these names: what their modes hold, {"modes": [...]}; else nothing."""
    shares = [
        share_of_mode(campaign.folder, functional, design=_design(campaign, functional))
        for name in names
        if (functional := campaign.study.functional(name)) is not None and functional.mode
    ]
    if not shares:
        return {}
    words = [f"pc{share.mode}_of_{share.history}" for share in shares]
    return {
        "modes": [
            {"name": name, "share": share.share, "runs": share.runs, "sentence": share.sentence}
            for name, share in zip(words, shares, strict=True)
        ]
    }


def _functionals(campaign: StoredRuns, names: Iterable[str]) -> list[Functional]:
    found = {name: campaign.study.functional(name) for name in (*campaign.study.functional_names, *names)}
    return [functional for functional in found.values() if functional is not None]


def _design(campaign: StoredRuns, functional: Functional) -> list[str]:
    """The runs of the design with a value, over which modes are defined."""
    if not functional.mode:
        return []
    document = read_json(campaign.folder / "design.json") or {"run_keys": []}
    statuses = campaign.store.statuses(document["run_keys"])
    return [key for key, status in statuses.items() if status == "ok"]


def _with_value(row: Evaluation, name: str, values: Mapping[str, float]) -> Evaluation:
    value = values.get(row.key)
    if value is None:
        return row
    if wrong := why_no_values({name: value}):
        return replace(row, status="nonfinite", outputs={}, error=wrong)
    return replace(row, outputs={**row.outputs, name: value})

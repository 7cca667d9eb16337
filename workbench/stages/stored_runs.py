"""The stored runs that a stage starts from: which, whether they are enough, and the most that it takes."""

import json
from collections import Counter
from collections.abc import Iterable

from workbench.campaign.results.failures import what_is_missing
from workbench.campaign.results.functionals import with_functionals
from workbench.campaign.results.thinning import spread_runs
from workbench.campaign.view import StoredRuns
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.stored.evaluation import UNFINISHED, Evaluation
from workbench.space.streams import stream
from workbench.system.atomic import read_json

__all__ = ["runs_as_text", "runs_with_values", "screening_runs", "thinned_runs"]

FEWEST_RUNS = 3


def screening_runs(campaign: StoredRuns, *, names: Iterable[str] = ()) -> list[Evaluation]:
    """What screening and the worst case start from: the design and what was told, never a search's runs.

    What the study reads off histories is among their outputs, and so are functionals of these `names`.
    """
    document = read_json(campaign.folder / "design.json") or {"run_keys": []}
    keys = dict.fromkeys(document["run_keys"])
    keys |= dict.fromkeys(row.key for row in campaign.runs() if row.batch == "told")
    rows = [row for row in campaign.store.rows(keys=list(keys)) if row.status not in UNFINISHED]
    return with_functionals(campaign, rows, names)


def runs_as_text(campaign: StoredRuns) -> str:
    """The screening runs as they enter a fingerprint: a new or changed run is another text."""
    return json.dumps([[row.key, row.status, row.outputs] for row in screening_runs(campaign)])


def runs_with_values(runs: list[Evaluation], response: str) -> list[Evaluation]:
    """The runs, or a refusal when their values cannot tell anything.

    Raises:
        NotEnoughRuns: fewer than 3 of them have a value.
        StudyError: the value is the same in all.
    """
    values = [row.outputs[response] for row in runs if row.status == "ok"]
    if len(values) < FEWEST_RUNS:
        raise NotEnoughRuns(
            f"{len(values)} of {len(runs)} runs gave a value, {FEWEST_RUNS} are needed: "
            f"{what_is_missing(Counter(row.status for row in runs))}"
        )
    if len(set(values)) == 1:
        raise StudyError(
            f"response {response!r} is {values[0]:g} in all {len(values)} runs; there is nothing to explain. "
            "Take another response, or parameters or wider ranges in which it changes"
        )
    return runs


def thinned_runs(
    campaign: StoredRuns, runs: list[Evaluation], response: str, *, most: int
) -> list[Evaluation]:
    """The runs, or of very many those that spread most over the box; it is said when some are left out."""
    if sum(row.status == "ok" for row in runs) <= most:
        return runs
    chosen = spread_runs(
        campaign.study.space, runs, response, most=most, rng=stream(campaign.study.seed, "thinning")
    )
    campaign.progress.note(f"{len(chosen)} of {len(runs)} runs are used: those that spread most over the box")
    return chosen

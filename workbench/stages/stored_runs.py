"""The stored runs that a stage starts from: which, whether they are enough, and the most that it takes.

They may be a million: they are read some thousand at a time, and what is held of all are columns.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from workbench.campaign.results.columns import RunColumns, run_columns
from workbench.campaign.results.failures import what_is_missing
from workbench.campaign.results.functionals import has_functionals, with_functionals
from workbench.campaign.results.thinning import spread_runs
from workbench.campaign.view import StoredRuns, as_of
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Reading
from workbench.models.stored.evaluation import UNFINISHED, Evaluation
from workbench.sampling.stored import design_keys
from workbench.space.streams import stream
from workbench.space.units import counted

__all__ = [
    "refuse_without_values",
    "runs_as_text",
    "screening_chunks",
    "screening_columns",
    "thinned",
]

FEWEST_RUNS = 3
AT_ONCE = 5_000  # runs that are held as records


def screening_chunks(campaign: StoredRuns, *, names: Iterable[str] = ()) -> Iterator[list[Evaluation]]:
    """What screening and the worst case start from: the design and what was told, never a search's runs.

    What the study reads off histories is among their outputs, and so are functionals of these `names`.
    """
    keys, names = _screening_keys(campaign), list(names)
    # a refusal for want of histories counts the runs: of those with functionals all come at once
    at_once = len(keys) if has_functionals(campaign, names) else AT_ONCE
    for begin in range(0, len(keys), max(at_once, 1)):
        rows = campaign.store.rows(keys=keys[begin : begin + at_once])
        yield with_functionals(campaign, [row for row in rows if row.status not in UNFINISHED], names)


def screening_columns(
    campaign: StoredRuns, readings: Mapping[str, Reading], *, names: Iterable[str] = ()
) -> RunColumns:
    """All of `screening_chunks` as columns, with what the `readings` give off the outputs of each."""
    names = list(names)

    def records(keys: Sequence[str]) -> list[Evaluation]:
        return with_functionals(campaign, campaign.store.rows(keys=keys), names)

    return run_columns(screening_chunks(campaign, names=names), readings, records)


def runs_as_text(campaign: StoredRuns) -> Iterator[str]:
    """The screening runs as they enter a fingerprint, in pieces: a new or changed run is another text."""
    yield "["
    between = ""
    for some in _answers(campaign):
        if some:
            yield between + some
            between = ", "
    yield "]"


def refuse_without_values(
    campaign: StoredRuns, response: str, values: np.ndarray, counts: Mapping[str, int]
) -> None:
    """A refusal when the values (of the runs that have one) cannot tell anything.

    counts: all runs that have an answer, by status.

    Raises:
        NotEnoughRuns: there are fewer than 3.
        StudyError: all are the same.
    """
    if len(values) < FEWEST_RUNS:
        waiting = sum(status in UNFINISHED for status in campaign.statuses().values())
        is_held = as_of(campaign.store).holder is not None
        why = what_is_missing(counts, waiting=waiting, under_way=is_held)
        runs = counted(sum(counts.values()) + waiting, "run")
        raise NotEnoughRuns(f"{len(values)} of {runs} gave a value, {FEWEST_RUNS} are needed: {why}")
    if values.min() == values.max():
        raise StudyError(
            f"response {response!r} is {values[0]:g} in all {len(values)} runs; there is nothing to explain. "
            "Take another response, or parameters or wider ranges in which it changes"
        )


def thinned(campaign: StoredRuns, runs: RunColumns, response: str, *, most: int) -> np.ndarray:
    """Positions of the runs, or of very many those that spread most over the box; it is said when some are
    left out."""
    if runs.is_ok.sum() <= most and len(runs) <= AT_ONCE:
        return np.arange(len(runs))
    chosen = spread_runs(
        campaign.study.space, runs, response, most=most, rng=stream(campaign.study.seed, "thinning")
    )
    campaign.progress.note(f"{len(chosen)} of {len(runs)} runs are used: those that spread most over the box")
    return chosen


def _screening_keys(campaign: StoredRuns) -> list[str]:
    """The runs of the design, and behind them those that were told with the present parameters."""
    keys = design_keys(campaign.folder / "design.json") or []
    spec, names = campaign.spec, set(campaign.study.space.names)
    told = campaign.store.select(
        "SELECT key, inputs FROM evaluation WHERE batch = 'told' AND model = ? AND version = ? ORDER BY id",
        [spec.identity, spec.version],
    )
    keys += [key for key, inputs in told if set(json.loads(inputs)) == names]
    return list(dict.fromkeys(keys))


def _answers(campaign: StoredRuns) -> Iterator[str]:
    """Key, status and outputs of the screening runs as JSON without its brackets, some at a time."""
    if has_functionals(campaign):
        for some in screening_chunks(campaign):
            yield json.dumps([(run.key, run.status, run.outputs) for run in some])[1:-1]
        return
    keys = _screening_keys(campaign)
    for begin in range(0, len(keys), AT_ONCE):
        yield campaign.store.answers_as_text(keys[begin : begin + AT_ONCE])

"""What ran: counts by status, the responses in the order run, failures and where in the box they lie."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from workbench.figures.runs import plot_failures, plot_response
from workbench.models.evaluation import Evaluation
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Note,
    Panel,
    Section,
    Table,
    names_of,
    number,
    percent,
)
from workbench.report.page.folder import CampaignFolder

__all__ = ["runs_section"]

MOST_PARAMETERS = 8  # shown in the map of failures: those whose failed runs stand most apart
MOST_SHOWN = 2_000  # runs drawn and listed; all are in results.csv
MOST_MESSAGES = 50
STATUS_WORDS = {
    "ok": "gave a value",
    "failed": "ended with an error",
    "timeout": "took too long and were stopped",
    "killed": "died or were killed",
    "nonfinite": "gave NaN or infinity",
    "skipped": "were skipped",
    "queued": "are waiting",
    "running": "are under way",
}
STAGE_WORDS = {"design": "design", "worst_case": "worst-case search", "told": "told", "table": "table"}


def runs_section(folder: CampaignFolder) -> Section | None:
    """None for a folder without runs."""
    if not folder.runs:
        return None
    counts = folder.counts
    batches = Counter(run.batch for run in folder.runs)
    failures = [run for run in folder.finished if run.status not in ("ok", "skipped")]
    sentence = "; ".join(f"{n} {STATUS_WORDS.get(status, status)}" for status, n in counts.items())
    sentences = [f"{len(folder.runs)} runs: {sentence}."]
    seconds = sum(run.wall or 0.0 for run in folder.runs)
    if seconds > 0:
        sentences.append(f"Together they took {number(seconds, 3)} s.")
    blocks: list[Block] = [
        Table(
            id="run-counts",
            title="Runs by stage and status",
            columns=(Column(name="stage"), *(Column(name=s) for s in counts), Column(name="all")),
            rows=tuple(
                (
                    STAGE_WORDS.get(batch, batch),
                    *(sum(r.batch == batch and r.status == s for r in folder.runs) for s in counts),
                    total,
                )
                for batch, total in batches.items()
            ),
        )
    ]
    if (drawn := _responses(folder)) is not None:
        blocks.append(drawn)
    if failures:
        share = len(failures) / len(folder.finished)
        blocks.append(
            Note(
                text=f"{len(failures)} of {len(folder.finished)} runs ({percent(share)}) gave no usable "
                "value. They are kept as data; conclusions hold only where the model could be run.",
                level="poor" if share > 0.2 else "fair",
            )
        )
        blocks.append(_failure_messages(failures))
        places = _failure_places(folder, failures)
        blocks += [] if places is None else [places]
    return Section(
        id="runs",
        title="What ran",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={"runs": len(folder.runs), "counts": counts, "by_stage": dict(batches)},
    )


def _responses(folder: CampaignFolder) -> Figure | None:
    response = folder.main_response
    finished = _thinned(folder.finished, response)
    shown = "every run" if len(finished) == len(folder.finished) else f"{len(finished)} of the runs"
    values = [r.outputs.get(response) if response and r.status == "ok" else None for r in finished]
    known = [v for v in values if isinstance(v, (int, float))]
    if response is None or not known:
        return None
    unit = folder.responses.get(response, "1")
    stages = [STAGE_WORDS.get(run.batch, run.batch) for run in finished]
    return Figure(
        id="responses",
        title=f"{response} of {shown}",
        alt=f"{response} of {len(known)} runs in the order run, from {number(min(known))} to "
        f"{number(max(known))}.",
        read_off="Circles are the design. A search that works climbs away from the cloud of the design.",
        panels=(
            Panel(
                draw=lambda ax: plot_response(values, stages=stages, label=response, unit=unit, ax=ax),
                width=6.4,
                height=2.7,
            ),
        ),
        table=Table(
            id="responses",
            title=f"{response} of {shown}",
            columns=(
                Column(name="run"),
                Column(name="key"),
                Column(name="stage"),
                Column(name="status"),
                Column(name=response, unit=unit),
            ),
            rows=tuple(
                (run.id, run.key, stage, run.status, value)
                for run, stage, value in zip(finished, stages, values, strict=True)
            ),
        ),
    )


def _thinned(runs: Sequence[Evaluation], response: str | None) -> list[Evaluation]:
    """Every so many of very many runs, with those of the smallest and the largest value."""
    if len(runs) <= MOST_SHOWN:
        return list(runs)
    chosen = {runs[k].key for k in np.linspace(0, len(runs) - 1, MOST_SHOWN - 2).astype(int)}
    good = [run for run in runs if run.status == "ok" and isinstance(run.outputs.get(response or ""), float)]
    if response is not None and good:
        chosen |= {end(good, key=lambda run: run.outputs[response]).key for end in (min, max)}
    return [run for run in runs if run.key in chosen]


def _failure_messages(failures: list[Evaluation]) -> Table:
    messages = Counter(
        (run.status, run.error.strip().splitlines()[-1] if run.error.strip() else "") for run in failures
    )
    return Table(
        id="failure-messages",
        title="Failures by message",
        columns=(
            Column(name="status"),
            Column(name="message"),
            Column(name="runs"),
            Column(name="first run"),
        ),
        rows=tuple(
            (
                status,
                message[:200],
                count,
                next(
                    r.id
                    for r in failures
                    if r.status == status and (r.error.strip().splitlines() or [""])[-1] == message
                ),
            )
            for (status, message), count in messages.most_common(MOST_MESSAGES)
        ),
    )


def _failure_places(folder: CampaignFolder, failures: list[Evaluation]) -> Figure | None:
    """Where in the box runs failed; None without a numeric parameter or a good run."""
    numeric = [
        name
        for name, p in folder.parameters.items()
        if p.get("lower") is not None and p.get("upper") is not None and p["upper"] > p["lower"]
    ]
    good = _thinned([run for run in folder.finished if run.status == "ok"], None)
    failures = _thinned(failures, None)
    if not numeric or not good:
        return None
    passed, failed = (_unit(folder, runs, numeric) for runs in (good, failures))
    apart = np.abs(np.median(passed, axis=0) - np.median(failed, axis=0))
    order = np.argsort(-apart, kind="stable")[:MOST_PARAMETERS]
    shown = [numeric[j] for j in order]
    return Figure(
        id="failures",
        title="Where runs failed",
        alt=f"Positions of {len(failed)} failed and {len(passed)} good runs along {names_of(shown)}.",
        read_off="Crosses that crowd at one end say which range the model cannot run. The parameters "
        "whose failures stand most apart come first.",
        panels=(
            Panel(
                draw=lambda ax: plot_failures(shown, passed=passed[:, order], failed=failed[:, order], ax=ax),
                width=6.0,
                height=1.2 + 0.32 * len(shown),
            ),
        ),
        table=Table(
            id="failures",
            title="Failed runs",
            columns=(
                Column(name="run"),
                Column(name="key"),
                Column(name="status"),
                *(Column(name=name, unit=folder.unit_of(name)) for name in shown),
            ),
            rows=tuple(
                (run.id, run.key, run.status, *(run.inputs.get(name) for name in shown)) for run in failures
            ),
        ),
    )


def _unit(folder: CampaignFolder, runs: list[Evaluation], names: list[str]) -> np.ndarray:
    """Positions of runs between the bounds, (n, d)."""
    p = folder.parameters
    return np.array(
        [
            [
                (float(run.inputs[name]) - p[name]["lower"]) / (p[name]["upper"] - p[name]["lower"])
                for name in names
            ]
            for run in runs
        ]
    )

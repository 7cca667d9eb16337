"""What ran: counts by status, the responses in the order run, failures and where in the box they lie."""

import numpy as np

from workbench.figures.runs import plot_failures, plot_response
from workbench.models.stored.evaluation import FAILED, Evaluation
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
from workbench.space.units import counted

__all__ = ["runs_of_layouts", "runs_section"]

MOST_PARAMETERS = 8  # shown in the map of failures: those whose failed runs stand most apart
MOST_SHOWN = 2_000  # runs drawn and listed; all are in runs.csv
MOST_MESSAGES = 50
SAMPLED = "every so many of each stage in the order run; all are in runs.csv"
STATUS_WORDS = {
    "ok": "gave a value",
    "failed": "ended with an error",
    "timeout": "took too long and were stopped",
    "killed": "died or were killed",
    "nonfinite": "gave NaN, infinity or a number beyond 1e140",
    "skipped": "were skipped",
    "queued": "are waiting",
    "running": "are under way",
}
STAGE_WORDS = {"design": "design", "worst_case": "worst-case search", "told": "told", "table": "table"}


def runs_section(folder: CampaignFolder) -> Section | None:
    """None for a folder without runs."""
    runs = folder.runs
    if not len(runs):
        return None
    counts, stages = runs.counts, runs.by_stage
    of_layouts = runs_of_layouts(folder)
    sentence = "; ".join(f"{n} {STATUS_WORDS.get(status, status)}" for status, n in counts.items())
    sentences = [f"{counted(len(runs), 'run')}: {sentence}."]
    if of_layouts:
        said = "; ".join(f"{n} {STATUS_WORDS.get(status, status)}" for status, n in of_layouts.items())
        sentences.append(
            f"The robust loop made {sum(of_layouts.values())} further true runs, of layouts, kept in "
            f"layouts.sqlite: {said}."
        )
    if folder.n_others:
        sentences.append(
            f"{counted(folder.n_others, 'more is', 'more are')} stored, of another model, version or set of "
            f"parameters; {'it is' if folder.n_others == 1 else 'they are'} no part of this."
        )
    if runs.wall > 0:
        which = "they" if not of_layouts else f"the {len(runs)} runs"
        sentences.append(f"Together {which} took {number(runs.wall, 3)} s.")
    statuses = list(dict.fromkeys([*counts, *of_layouts]))
    rows = {STAGE_WORDS.get(stage, stage): of for stage, of in stages.items()}
    if of_layouts:
        rows["layouts of the robust loop"] = of_layouts
    blocks: list[Block] = [
        Table(
            id="run-counts",
            title="Runs by stage and status",
            columns=(Column(name="stage"), *(Column(name=s) for s in statuses), Column(name="all")),
            rows=tuple(
                (stage, *(of.get(s, 0) for s in statuses), sum(of.values())) for stage, of in rows.items()
            ),
        )
    ]
    if (drawn := _responses(folder)) is not None:
        blocks.append(drawn)
    failures = runs.with_status(*FAILED)
    if len(failures):
        share = len(failures) / len(runs.finished)
        blocks.append(
            Note(
                text=f"{len(failures)} of {len(runs.finished)} runs ({percent(share)}) gave no usable "
                "value. They are kept as data; conclusions hold only where the model could be run.",
                level="poor" if share > 0.2 else "fair",
            )
        )
        blocks.append(_failure_messages(folder))
        places = _failure_places(folder, failures)
        blocks += [] if places is None else [places]
    return Section(
        id="runs",
        title="What ran",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={
            "runs": len(runs),
            "counts": counts,
            "by_stage": {stage: sum(of.values()) for stage, of in stages.items()},
            "of_layouts": of_layouts,
        },
    )


def runs_of_layouts(folder: CampaignFolder) -> dict[str, int]:
    """True runs of the robust loop by status, which its own store holds; none without a loop."""
    loop = folder.documents.get("robust_layout") or {}
    return {str(status): int(n) for status, n in loop.get("runs", {}).items() if n}


def _responses(folder: CampaignFolder) -> Figure | None:
    response, runs = folder.main_response, folder.runs
    known = np.zeros(0) if response is None else runs.values(response)[runs.with_status("ok")]
    known = known[np.isfinite(known)]
    if response is None or not len(known):
        return None
    finished = runs.finished
    shown = runs.at(runs.sample(finished, most=MOST_SHOWN, among=response))
    values = [run.outputs.get(response) if run.status == "ok" else None for run in shown]
    unit = folder.responses.get(response, "1")
    stages = [STAGE_WORDS.get(run.batch, run.batch) for run in shown]
    which, sampled = "every run", ""
    if len(shown) < len(finished):
        which = f"{len(shown)} of {len(finished)} runs"
        sampled = f" {len(shown)} of {len(finished)} runs are drawn and listed: {SAMPLED}."
    return Figure(
        id="responses",
        title=f"{response} of {which}",
        alt=f"{response} of {len(known)} runs in the order run, from {number(float(known.min()))} to "
        f"{number(float(known.max()))}.",
        read_off="Circles are the design. A search that works leaves the cloud of the design." + sampled,
        panels=(
            Panel(
                draw=lambda ax: plot_response(
                    values,
                    stages=stages,
                    numbers=[run.id for run in shown] if sampled else None,
                    label=response,
                    unit=unit,
                    ax=ax,
                ),
                width=6.4,
                height=2.7,
            ),
        ),
        table=Table(
            id="responses",
            title=f"{response} of {which}",
            columns=(
                Column(name="run"),
                Column(name="key"),
                Column(name="stage"),
                Column(name="status"),
                Column(name=response, unit=unit),
            ),
            rows=tuple(
                (run.id, run.key, stage, run.status, value)
                for run, stage, value in zip(shown, stages, values, strict=True)
            ),
        ),
    )


def _failure_messages(folder: CampaignFolder) -> Table:
    """Failures by status and cause, those that differ in their numbers alone as one."""
    groups = folder.runs.failures
    more = f", the {MOST_MESSAGES} that came most often of {len(groups)}" * (len(groups) > MOST_MESSAGES)
    return Table(
        id="failure-messages",
        title=f"Failures by message{more}",
        columns=(
            Column(name="status"),
            Column(name="message"),
            Column(name="runs"),
            Column(name="first run"),
        ),
        rows=tuple((f.status, f.cause, f.count, f.first) for f in groups[:MOST_MESSAGES]),
    )


def _failure_places(folder: CampaignFolder, failures: np.ndarray) -> Figure | None:
    """Where in the box runs failed; None without a numeric parameter or a good run."""
    numeric = [
        name
        for name, p in folder.parameters.items()
        if p.get("lower") is not None and p.get("upper") is not None and p["upper"] > p["lower"]
    ]
    every = folder.runs.with_status("ok")
    if not numeric or not len(every):
        return None
    good, bad = (folder.runs.at(folder.runs.sample(some, most=MOST_SHOWN)) for some in (every, failures))
    passed, failed = (_unit(folder, runs, numeric) for runs in (good, bad))
    sampled = ""
    if len(good) + len(bad) < len(every) + len(failures):
        sampled = (
            f" {len(bad)} of {len(failures)} failed and {len(good)} of {len(every)} good runs are drawn: "
            f"{SAMPLED}."
        )
    apart = np.abs(np.median(passed, axis=0) - np.median(failed, axis=0))
    order = np.argsort(-apart, kind="stable")[:MOST_PARAMETERS]
    shown = [numeric[j] for j in order]
    return Figure(
        id="failures",
        title="Where runs failed",
        alt=f"Positions of {len(failed)} failed and {len(passed)} good runs along {names_of(shown)}.",
        read_off="Crosses that crowd at one end say which range the model cannot run. The parameters "
        f"whose failures stand most apart come first.{sampled}",
        panels=(
            Panel(
                draw=lambda ax: plot_failures(shown, passed=passed[:, order], failed=failed[:, order], ax=ax),
                width=6.0,
                height=1.2 + 0.32 * len(shown),
            ),
        ),
        table=Table(
            id="failures",
            title="Failed runs"
            if len(bad) == len(failures)
            else f"{len(bad)} of {len(failures)} failed runs",
            columns=(
                Column(name="run"),
                Column(name="key"),
                Column(name="status"),
                *(Column(name=name, unit=folder.unit_of(name)) for name in shown),
            ),
            rows=tuple(
                (run.id, run.key, run.status, *(run.inputs.get(name) for name in shown)) for run in bad
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

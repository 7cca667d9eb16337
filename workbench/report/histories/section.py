"""The section on time histories: per name bands of all runs, the runs at the far end, the first modes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.errors import NotEnoughRuns, StoreError, StudyError
from workbench.figures.histories import QUANTILES, plot_bands, plot_modes
from workbench.histories.modes import Modes, modes_of
from workbench.histories.stack import HistoryStack, stacked_anyway
from workbench.histories.store import HistoryStore
from workbench.models.stored.evaluation import Evaluation
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
    quantity,
)
from workbench.report.page.folder import CampaignFolder

__all__ = ["histories_section"]

SHOWN = 6  # names; responses come first
SAMPLES = 300  # times at which bands and modes are found
LINES = 40  # runs that are drawn one by one
WORST = 3
MODES = 3
MODE_RUNS = 1_000  # runs that modes are found from
TABLE_ROWS = 31


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """Histories of one name: at `samples` of its times, the runs in order, quantiles (7, m), peaks (n,)."""

    stack: HistoryStack
    runs: list[Evaluation]
    samples: np.ndarray
    quantiles: np.ndarray
    peaks: np.ndarray

    @property
    def times(self) -> np.ndarray:
        return self.stack.times[self.samples]


def histories_section(folder: CampaignFolder) -> Section | None:
    """None for a campaign that keeps no histories."""
    store = HistoryStore.reading(folder.path)
    if store is None:
        return None
    with store:
        names = sorted(store.names(), key=lambda name: (name not in folder.responses, name))
    blocks: list[Block] = []
    numbers = {}
    runs = {run.key: run for run in folder.runs.at(folder.runs.with_status("ok"))}
    for name in names[:SHOWN]:
        try:
            look = _look(folder, name, runs)
        except StudyError as exc:
            if runs:
                blocks.append(Note(text=f"{exc}.", level="fair"))
            continue
        except StoreError as exc:
            blocks.append(Note(text=f"The histories {name!r} are not shown. {exc}.", level="poor"))
            continue
        modes = _modes(look)
        blocks += [_bands(folder, name, look), _worst_runs(folder, name, look)]
        if modes is not None:
            blocks += [_mode_figure(name, look, modes), _mode_table(folder, name, look, modes)]
        numbers[name] = {
            "runs": len(look.runs),
            "samples": len(look.stack.times),
            "shares": [] if modes is None else modes.shares.tolist(),
        }
    if not blocks:
        return None
    sentences = [
        f"Kept over time: {names_of(names)}. Bands are of all runs with a value, instant by instant."
    ]
    if len(names) > SHOWN:
        sentences.append(f"The first {SHOWN} are shown; `campaign.histories(name)` gives the others.")
    return Section(
        id="histories",
        title="Over time",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers=numbers,
    )


def _look(folder: CampaignFolder, name: str, runs: dict[str, Evaluation]) -> _Look:
    stack = stacked_anyway(folder.path, name, list(runs), samples=SAMPLES)
    samples = np.unique(np.linspace(0, len(stack.times) - 1, SAMPLES).astype(int))
    everyone = range(len(stack.entries))
    quantiles, peaks = [], np.full(len(stack.entries), -np.inf)
    for block in stack.by_times(everyone, samples):
        missing = bool(np.isnan(block).any())
        quantiles.append((np.nanquantile if missing else np.quantile)(block, QUANTILES, axis=0))
        peaks = np.fmax(peaks, np.nanmax(np.abs(block), axis=1) if not missing else _peaks(block))
    return _Look(
        stack=stack,
        runs=[runs[key] for key in stack.keys],
        samples=samples,
        quantiles=np.hstack(quantiles),
        peaks=peaks,
    )


def _peaks(block: np.ndarray) -> np.ndarray:
    """The largest size of each row that has a number, else minus infinity."""
    return np.where(np.isnan(block), -np.inf, np.abs(block)).max(axis=1)


def _worst(folder: CampaignFolder, name: str, look: _Look) -> tuple[list[int], str]:
    """The worst runs, and of what: of the response of that name as the study means it, or of the size."""
    values = np.array([run.outputs.get(name, np.nan) for run in look.runs], dtype=float)
    if not np.isfinite(values).all():
        return np.argsort(-look.peaks, kind="stable")[:WORST].tolist(), "the largest size over time"
    given = folder.lock.get("resolved", {}).get("response", [])
    reduced = next((r.get("reduce") for r in given if r.get("name") == name), None)
    search = folder["worst_case"] or {}
    sense = search.get("sense") if search.get("response") == name else reduced
    if sense == "min":
        return np.argsort(values, kind="stable")[:WORST].tolist(), f"the smallest {name}"
    return np.argsort(-values, kind="stable")[:WORST].tolist(), f"the largest {name}"


def _whole(look: _Look, run: int) -> np.ndarray:
    return look.stack.values([run], range(len(look.stack.times)))[0]


def _bands(folder: CampaignFolder, name: str, look: _Look) -> Figure:
    stack, (worst, words) = look.stack, _worst(folder, name, look)
    n = len(look.runs)
    chosen = np.unique(np.linspace(0, n - 1, min(n, LINES)).astype(int))
    lines = list(stack.values(chosen, look.samples))
    named = {folder.run_name(look.runs[k].key).split(" (")[0]: (stack.times, _whole(look, k)) for k in worst}
    drawn = "All runs" if len(chosen) == n else f"{len(chosen)} of {n} runs"
    how = " Runs stand on different times; values are on straight lines between samples." * stack.interpolated
    rows = np.unique(np.linspace(0, len(look.samples) - 1, TABLE_ROWS).astype(int))
    last = look.quantiles[:, -1]
    return Figure(
        id=f"bands-{name}",
        title=f"{name} over time",
        alt=f"Bands of {name} of {n} runs over {number(look.times[0], 3)} to {number(look.times[-1], 3)}; at "
        f"the end the median is {number(last[3], 3)} and 90 % lie within {number(last[1], 3)} and "
        f"{number(last[5], 3)}.",
        read_off=f"The bands hold all {n} runs, 90 % and 50 % of them at each instant: no run need follow "
        f"their edge. {drawn} are drawn thin; the runs with {words} are orange.{how}",
        panels=(
            Panel(
                draw=lambda ax: plot_bands(
                    look.times, look.quantiles, runs=lines, worst=named, label=name, unit=stack.unit, ax=ax
                ),
                width=6.4,
                height=2.9,
            ),
        ),
        table=Table(
            id=f"bands-{name}",
            title=f"Bands of {name}",
            columns=(
                Column(name="time"),
                *(
                    Column(name=words, unit=stack.unit)
                    for words in ("smallest", "5 %", "25 %", "median", "75 %", "95 %", "largest")
                ),
            ),
            rows=tuple((float(look.times[k]), *map(float, look.quantiles[:, k])) for k in rows),
        ),
    )


def _worst_runs(folder: CampaignFolder, name: str, look: _Look) -> Table:
    worst, words = _worst(folder, name, look)
    parameters = list(folder.parameters)
    rows = []
    for k in worst:
        row, run = _whole(look, k), look.runs[k]
        there = np.flatnonzero(~np.isnan(row))
        at = int(there[np.abs(row[there]).argmax()]) if len(there) else 0
        place = (float(row[at]), float(look.stack.times[at]))
        rows.append((run.id, run.key, *place, *(run.inputs.get(p) for p in parameters)))
    return Table(
        id=f"worst-{name}",
        title=f"Runs with {words}",
        columns=(
            Column(name="run"),
            Column(name="key"),
            Column(name=f"value of largest size of {name}", unit=look.stack.unit),
            Column(name="at time"),
            *(Column(name=p, unit=folder.unit_of(p)) for p in parameters),
        ),
        rows=tuple(rows),
        folded=True,
    )


def _modes(look: _Look) -> Modes | None:
    """The first modes of runs that cover all times; None without any."""
    n = len(look.runs)
    chosen = np.unique(np.linspace(0, n - 1, min(n, MODE_RUNS)).astype(int))
    values = look.stack.values(chosen, look.samples)
    values = values[np.isfinite(values).all(axis=1)]
    try:
        return modes_of(values, look.times, count=MODES)
    except NotEnoughRuns:
        return None


def _mode_figure(name: str, look: _Look, modes: Modes) -> Figure:
    names = [f"mode {k + 1}: {percent(share, 1)}" for k, share in enumerate(modes.shares)]
    shapes = modes.shapes * modes.deviations[:, None]
    rows = np.unique(np.linspace(0, len(look.samples) - 1, TABLE_ROWS).astype(int))
    together = percent(float(modes.shares.sum()), 1)
    return Figure(
        id=f"modes-{name}",
        title=f"Modes of {name}",
        alt=f"The first {len(names)} principal components of {name} over time; together they hold {together} "
        "of the variance.",
        read_off=f"The shapes by which {modes.runs} runs differ from their mean, each as large as one "
        f"standard deviation over the runs. The first {len(names)} hold {together} of the variance over "
        "time; a run is the mean plus so much of each.",
        panels=(
            Panel(
                draw=lambda ax: plot_modes(
                    look.times, shapes, names=names, label=name, unit=look.stack.unit, ax=ax
                ),
                width=6.4,
                height=2.4,
            ),
        ),
        table=Table(
            id=f"modes-{name}",
            title=f"Modes of {name}, one standard deviation",
            columns=(
                Column(name="time"),
                Column(name="mean", unit=look.stack.unit),
                *(Column(name=f"mode {k + 1}", unit=look.stack.unit) for k in range(len(names))),
            ),
            rows=tuple((float(look.times[j]), float(modes.mean[j]), *map(float, shapes[:, j])) for j in rows),
        ),
    )


def _mode_table(folder: CampaignFolder, name: str, look: _Look, modes: Modes) -> Table:
    """Shares, and the parameter whose values go most with the score of each mode."""
    values = look.stack.values(range(min(len(look.runs), MODE_RUNS)), look.samples)
    scores = modes.scores(values)
    numeric = [p for p in folder.parameters if all(_is_number(r.inputs.get(p)) for r in look.runs)]
    rows = []
    for k, share in enumerate(modes.shares):
        best = max(
            ((abs(r), p, r) for p in numeric if (r := _correlation(look.runs, p, scores[:, k])) is not None),
            default=None,
        )
        most = ("", None) if best is None else (best[1], best[2])
        spread = quantity(float(modes.deviations[k]), look.stack.unit, 3)
        rows.append((f"mode {k + 1}", float(share), float(modes.shares[: k + 1].sum()), spread, *most))
    return Table(
        id=f"mode-shares-{name}",
        title=f"What the modes of {name} hold",
        columns=(
            Column(name="mode"),
            Column(name="share of the variance"),
            Column(name="with those before"),
            Column(name="standard deviation"),
            Column(name="goes most with"),
            Column(name="correlation"),
        ),
        rows=tuple(rows),
    )


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _correlation(runs: Sequence[Evaluation], parameter: str, scores: np.ndarray) -> float | None:
    x = np.array([float(run.inputs[parameter]) for run in runs[: len(scores)]])
    good = np.isfinite(scores)
    if good.sum() < 3 or np.ptp(x[good]) == 0 or np.ptp(scores[good]) == 0:
        return None
    return float(np.corrcoef(x[good], scores[good])[0, 1])

"""All true runs as lines over the parameters: what the worst of them have in common.

A parameter with few values is an axis of levels with its values or words as ticks, any other an axis from its
lower to its upper bound (of its logarithm where it works in that).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.figures.parts import axis_label
from workbench.figures.worst_case import plot_parallel
from workbench.models.stored.evaluation import Evaluation
from workbench.report.page.blocks import (
    Column,
    Figure,
    Panel,
    Table,
    names_of,
    number,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.worst_case.figures import selected_names
from workbench.space.box import Parameter

__all__ = ["parallel_figure"]

MOST_SHOWN = 2_000  # runs drawn and listed; all are in runs.csv
SAMPLED = "every so many of each stage in the order run; all are in runs.csv"
MOST_AXES = 10
MOST_TICKS = 7  # of an axis of levels; of more levels the ends are named
FEWEST_RUNS = 10
FEWEST_AXES = 2


def parallel_figure(folder: CampaignFolder, worst: Mapping[str, Any], response: str) -> Figure | None:
    """All true runs over the parameters that matter; None when there are too few."""
    axes = _axes(folder)
    value, total = _values(folder, worst, response)
    runs = [
        run
        for run in folder.runs.named(list(value)).values()
        if all(axis.name in run.inputs for axis in axes)
    ]
    keys = [run.key for run in runs]
    if len(runs) < FEWEST_RUNS or len(axes) < FEWEST_AXES or worst.get("run_key") not in keys:
        return None
    points = _unit_points(axes, runs)
    if points is None:
        return None
    names = [axis.name for axis in axes]
    values = np.array([value[run.key] for run in runs])
    index = keys.index(str(worst["run_key"]))
    labels = [axis_label(axis.name, axis.unit).replace(" [", "\n[") for axis in axes]
    ticks = [_ticks(axis) for axis in axes]

    sampled = ""
    if len(value) < total:
        sampled = f" {len(runs)} of {total} runs are drawn and listed: the worst, and {SAMPLED}."

    def draw(ax: Any) -> Any:
        return plot_parallel(points, values=values, names=labels, worst=index, ticks=ticks, ax=ax)

    return Figure(
        id="parallel",
        title="What the worst runs have in common",
        alt=f"{len(runs)} runs as lines over {names_of(names)}; the worst tenth in colour.",
        read_off="Where the coloured lines run together, that value makes things bad; where they fan out, "
        f"the parameter does not decide.{sampled}",
        panels=(Panel(draw=draw, width=max(6.4, 0.9 * len(names)), height=3.1),),
        table=Table(
            id="parallel",
            title="True runs over the parameters that matter",
            columns=(
                Column(name="run"),
                Column(name=response, unit=str(worst.get("unit") or "1")),
                *(Column(name=n, unit=folder.unit_of(n)) for n in names),
            ),
            rows=tuple((run.id, value[run.key], *(run.inputs[n] for n in names)) for run in runs),
            marked=frozenset({index}),
        ),
    )


def _values(folder: CampaignFolder, worst: Mapping[str, Any], response: str) -> tuple[dict[str, float], int]:
    """What was searched, by the keys of the runs that gave it, of many of some; and how many gave it."""
    if worst.get("weights") or worst.get("within"):  # no output of a run, but the search read it
        found = {
            str(h["run_key"]): float(h["value"])
            for h in worst.get("history") or []
            if h.get("value") is not None
        }
        return found, len(found)
    runs = folder.runs
    values = runs.values(response)
    known = runs.with_status("ok")
    known = known[np.isfinite(values[known])]
    place = runs.place(str(worst.get("run_key")))
    shown = runs.sample(known, most=MOST_SHOWN, always=() if place is None else (place,))
    return dict(zip(runs.keys(shown), values[shown].tolist(), strict=True)), len(known)


def _axes(folder: CampaignFolder) -> list[Parameter]:
    """The parameters that were selected, or all when fewer than two were."""
    names, known = selected_names(folder), folder.parameters
    if len(names) < FEWEST_AXES:
        names += [name for name in known if name not in names]
    return [Parameter.from_dict(known[name]) for name in names if name in known][:MOST_AXES]


def _unit_points(axes: Sequence[Parameter], runs: Sequence[Evaluation]) -> np.ndarray | None:
    """The runs (n, d) in the unit cube; None when the parameters are not those of the runs any more."""
    try:
        return np.column_stack([axis.unit_of([run.inputs[axis.name] for run in runs]) for axis in axes])
    except StudyError:
        return None


def _ticks(axis: Parameter) -> dict[float, str]:
    """Places in the unit interval and what stands there."""
    levels = axis.unit_levels
    if levels is None or len(levels) > MOST_TICKS:
        return {0.0: number(axis.lower), 1.0: number(axis.upper)} if axis.lower is not None else {}
    # physical() takes the middle of a level's share of the interval, never its border
    inside = (np.arange(len(levels)) + 0.5) / len(levels)
    return {float(u): number(v) for u, v in zip(levels, axis.physical(inside).tolist(), strict=True)}

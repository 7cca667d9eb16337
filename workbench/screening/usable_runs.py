"""The runs that a screening uses: rows of any kind in, points and values out; failures are counted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Outcome
from workbench.models.stored.evaluation import Evaluation
from workbench.models.values import is_value
from workbench.space.box import Space

__all__ = ["Rows", "UsableRuns", "usable_runs"]

FEWEST_RUNS = 3

Rows = Sequence[Outcome | Evaluation | Mapping[str, Any]] | pd.DataFrame | xr.Dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class UsableRuns:
    """Runs with a value: their names, points x (n, d) in [0, 1], values y (n,), and how many had none."""

    ids: list[str]
    x: np.ndarray
    y: np.ndarray
    n_left_out: int


def usable_runs(rows: Rows, space: Space, response: str) -> UsableRuns:
    """The runs that have a value.

    Raises:
        NotEnoughRuns: fewer than 3 of them.
        StudyError: a run without the response, with parameters that are not of the space, or with something
            else than a number.
    """
    outcomes = _as_outcomes(rows, space, response)
    ids: list[str] = []
    inputs: list[Mapping[str, Any]] = []
    values: list[float] = []
    for i, run in enumerate(outcomes):
        if run.status == "ok" and response not in run.outputs:
            raise StudyError(f"run {run.key or i} has no response {response!r}; it has {list(run.outputs)}")
        if run.status == "ok" and is_value(float(run.outputs[response])):
            ids.append(run.key or str(i))
            inputs.append({name: run.parameters[name] for name in space.names})
            values.append(float(run.outputs[response]))
    if len(values) < FEWEST_RUNS:
        raise NotEnoughRuns(
            f"screening {response!r} needs at least {FEWEST_RUNS} runs with a value, got {len(values)} of "
            f"{len(outcomes)}: add runs or look at why they failed"
        )
    return UsableRuns(
        ids=ids,
        x=_columns(space, ids, inputs),
        y=np.array(values),
        n_left_out=len(outcomes) - len(values),
    )


def _as_outcomes(rows: Rows, space: Space, response: str) -> list[Outcome]:
    if isinstance(rows, str | PathLike):
        raise StudyError(
            f"rows needs runs as mappings, or a table, got the name {str(rows)!r}; "
            "read the file first, as by pandas.read_csv"
        )
    if isinstance(rows, xr.Dataset):
        rows = rows.to_dataframe().reset_index()
    if isinstance(rows, pd.DataFrame):
        missing = [c for c in (*space.names, response) if c not in rows.columns]
        if missing:
            raise StudyError(f"the table of runs has no column {missing[0]!r}; it has {list(rows.columns)}")
        table = rows[[*space.names, response]].to_dict("records")
        index = [str(i) for i in rows.index]
        return [_outcome(row, space, response, key) for row, key in zip(table, index, strict=True)]
    found = []
    for i, row in enumerate(rows):
        if isinstance(row, Outcome | Evaluation):
            found.append(row if isinstance(row, Outcome) else row.as_outcome())
            continue
        missing = [name for name in (*space.names, response) if name not in row]
        if missing:
            raise StudyError(f"run {i} has no {missing[0]!r}; it has {list(row)}")
        found.append(_outcome(row, space, response, str(i)))
    return found


def _outcome(row: Mapping[Any, Any], space: Space, response: str, key: str) -> Outcome:
    value = row[response]
    try:
        number = float("nan") if value is None or value is pd.NA else float(value)
    except (TypeError, ValueError):
        raise StudyError(
            f"run {key} has {value!r} where a number of {response!r} should be: leave the run out, or give "
            "it None or NaN to have it counted as failed"
        ) from None
    status = "ok" if is_value(number) else "nonfinite"
    outputs = {response: number} if status == "ok" else {}
    return Outcome(parameters={n: row[n] for n in space.names}, status=status, outputs=outputs, key=key)


def _columns(space: Space, ids: Sequence[str], inputs: Sequence[Mapping[str, Any]]) -> np.ndarray:
    try:
        return np.asarray(space.unit(inputs), dtype=float)
    except StudyError as error:
        for key, row in zip(ids, inputs, strict=True):
            try:
                space.unit([row])
            except StudyError as single:
                raise StudyError(f"run {key}: {single}. Correct it, or leave the run out") from error
        raise

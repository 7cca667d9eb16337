"""Runs as xarray Datasets, pandas frames and files (netCDF, CSV, parquet), which are written whole.

CSV and netCDF are written in one pass over the stored runs, of which some thousand are held at a time.
"""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.campaign.results.netcdf import RunColumns
from workbench.campaign.view import StoredRuns
from workbench.errors import StudyError
from workbench.histories.netcdf import write_histories
from workbench.models.stored.evaluation import Evaluation
from workbench.models.stored.run_chunks import RunChunk
from workbench.space.box import Response, Space
from workbench.system.atomic import write_whole
from workbench.system.spreadsheet import spreadsheet_cell

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["csv_pieces", "dataset", "frame", "write_all", "write_parquet"]


def dataset(
    runs: Sequence[Evaluation], space: Space, responses: Sequence[Response], *, name: str
) -> "xr.Dataset":
    """Runs over the dimension `run` (their keys): parameters, responses (NaN without a value), status."""
    import xarray as xr

    variables: dict[str, Any] = {}
    for p in space.parameters:
        values = np.array([r.inputs[p.name] for r in runs], dtype=float if p.is_numeric else str)
        variables[p.name] = (
            "run",
            values,
            {"units": p.unit, "role": "parameter", "long_name": p.label or p.name},
        )
    for response in responses:
        values = np.array([r.outputs.get(response.name, math.nan) for r in runs], dtype=float)
        attributes = {
            "units": response.unit,
            "role": "response",
            "long_name": response.label or response.name,
        }
        variables[response.name] = ("run", values, attributes)
    for column in ("status", "batch"):
        variables[column] = ("run", np.array([getattr(r, column) for r in runs], dtype=str))
    keys = np.array([r.key for r in runs], dtype=str)
    return xr.Dataset(variables, coords={"run": keys}, attrs={"study": name, "space_hash": space.hash})


def frame(runs: Sequence[Evaluation], space: Space, responses: Sequence[Response]) -> "pd.DataFrame":
    """One row per run; the index is the key, units stand in `attrs["units"]`."""
    import pandas as pd

    table = pd.DataFrame(
        [
            {
                "key": r.key,
                "status": r.status,
                "batch": r.batch,
                **r.inputs,
                **{response.name: r.outputs.get(response.name, math.nan) for response in responses},
                "error": r.error,
                "seconds": r.wall,
            }
            for r in runs
        ],
        columns=["key", "status", "batch", *space.names, *(r.name for r in responses), "error", "seconds"],
    ).set_index("key")
    table.attrs["units"] = dict(zip(space.names, space.units, strict=True)) | {
        r.name: r.unit for r in responses
    }
    return table


def write_all(
    campaign: StoredRuns,
    *,
    folder: Path | None = None,
    parquet: bool = False,
    histories: bool = False,
    raw: bool = False,
    beside: Callable[[RunChunk], None] | None = None,
) -> list[Path]:
    """`runs.csv`, `results.nc` and, if asked for, `runs.parquet` and `histories.nc`; their paths.

    `folder`: where they are written, the campaign's own by default.    `raw`: a text that a spreadsheet
    would take for a formula stays as it is; else it gets an apostrophe in front.    `beside`: is given the
    runs as they pass.
    """
    study = campaign.study
    place = campaign.folder if folder is None else folder
    paths = [place / "runs.csv", place / "results.nc"]
    columns = RunColumns(study.space, study.responses, name=study.name)
    keys: list[str] = []

    def chunks() -> Iterator[RunChunk]:
        for chunk in campaign.chunks():
            columns.take(chunk)
            if histories:
                keys.extend(chunk.keys)
            if beside is not None:
                beside(chunk)
            yield chunk

    write_whole(paths[0], csv_pieces(chunks(), study.space, study.responses, raw=raw))
    columns.write(paths[1])
    if parquet:
        paths.append(place / "runs.parquet")
        write_parquet(paths[-1], frame(campaign.runs(), study.space, study.responses))
    if histories:
        paths.append(place / "histories.nc")
        write_histories(paths[-1], campaign.folder, keys)
    return paths


def csv_pieces(
    chunks: Iterable[RunChunk], space: Space, responses: Sequence[Response], *, raw: bool
) -> Iterator[bytes]:
    """Runs as CSV in full precision; units stand in results.nc, a second header line would break readers."""
    names = [r.name for r in responses]
    words = [not p.is_numeric for p in space.parameters]
    yield _csv([["key", "status", "batch", *space.names, *names, "error"]])
    for chunk in chunks:
        given = [[inputs[name] for inputs in chunk.inputs] for name in space.names]
        found = [[outputs.get(name, "") for outputs in chunk.outputs] for name in names]
        errors: Sequence[str] = chunk.errors
        if not raw:  # of columns that hold texts
            given = [
                [spreadsheet_cell(v) for v in values] if is_word else values
                for values, is_word in zip(given, words, strict=True)
            ]
            errors = [spreadsheet_cell(error) for error in errors]
        columns = [chunk.keys, chunk.statuses, chunk.batches, *given, *found, errors]
        yield _csv(zip(*columns, strict=True))


def _csv(rows: Iterable[Sequence[Any]]) -> bytes:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue().encode()


def write_parquet(path: Path, table: "pd.DataFrame") -> None:
    """A frame as parquet.

    Raises:
        StudyError: pyarrow is not installed.
    """
    try:
        import pyarrow  # type: ignore[import-not-found, unused-ignore]  # noqa: F401
    except ImportError:
        raise StudyError("parquet needs pyarrow: pip install 'holdfast[parquet]'") from None
    content = table.to_parquet(None)
    assert isinstance(content, bytes)
    write_whole(path, content)

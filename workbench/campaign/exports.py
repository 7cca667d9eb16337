"""Runs as xarray Datasets, pandas frames and files (netCDF, CSV, parquet), which are written whole."""

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.campaign.view import StoredRuns
from workbench.errors import StudyError
from workbench.models.evaluation import Evaluation
from workbench.space.box import Response, Space
from workbench.system.atomic import write_text, write_whole
from workbench.system.spreadsheet import spreadsheet_cell

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["dataset", "frame", "write_all", "write_csv", "write_netcdf", "write_parquet"]


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
    campaign: StoredRuns, *, folder: Path | None = None, parquet: bool = False, raw: bool = False
) -> list[Path]:
    """`runs.csv`, `results.nc` and, if asked for, `runs.parquet`; their paths.

    `folder`: where they are written, the campaign's own by default.    `raw`: see `write_csv`.
    """
    study, runs = campaign.study, campaign.runs()
    place = campaign.folder if folder is None else folder
    paths = [place / "runs.csv", place / "results.nc"]
    write_csv(paths[0], runs, study.space, study.responses, raw=raw)
    write_netcdf(paths[1], dataset(runs, study.space, study.responses, name=study.name))
    if parquet:
        paths.append(place / "runs.parquet")
        write_parquet(paths[-1], frame(runs, study.space, study.responses))
    return paths


def write_csv(
    path: Path,
    runs: Sequence[Evaluation],
    space: Space,
    responses: Sequence[Response],
    *,
    raw: bool = False,
) -> None:
    """Runs as CSV in full precision; units stand in results.nc, a second header line would break readers.

    A text that a spreadsheet would take for a formula gets an apostrophe in front, unless `raw`.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names = [r.name for r in responses]
    writer.writerow(["key", "status", "batch", *space.names, *names, "error"])
    for r in runs:
        values = [r.inputs[n] for n in space.names] + [r.outputs.get(n, "") for n in names]
        cells = [r.key, r.status, r.batch, *values, r.error]
        writer.writerow(cells if raw else map(spreadsheet_cell, cells))
    write_text(path, out.getvalue())


def write_netcdf(path: Path, data: "xr.Dataset") -> None:
    """A Dataset as netCDF 3 (64-bit offset), which every netCDF library reads; bytes follow the data."""
    content = data.to_netcdf(None, format="NETCDF3_64BIT", engine="scipy")
    write_whole(path, bytes(content))


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

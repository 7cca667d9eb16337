"""Time histories of runs: `histories/<key>.nc` beside the database, one netCDF 3 file per run."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from workbench.errors import StoreError
from workbench.models.histories import History
from workbench.system.atomic import write_whole

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_histories", "write_histories"]

FOLDER = "histories"


def write_histories(
    folder: Path, key: str, histories: Mapping[str, History], units: Mapping[str, str]
) -> None:
    """Write the histories of a run; each response has its own time axis."""
    from scipy.io import netcdf_file

    buffer = io.BytesIO()
    file = netcdf_file(buffer, "w")
    for name, history in histories.items():
        axis = f"time_{name}"
        file.createDimension(axis, len(history.time))
        for variable, values in ((axis, history.time), (name, history.values)):
            file.createVariable(variable, "f8", (axis,))[:] = np.asarray(values, dtype=float)
        setattr(file.variables[name], "units", units[name].encode())  # noqa: B010 - attributes are made here
    file.flush()
    content = buffer.getvalue()
    (folder / FOLDER).mkdir(exist_ok=True)
    write_whole(folder / FOLDER / f"{key}.nc", content)


def read_histories(folder: Path, key: str) -> "xr.Dataset":
    """The histories of a run.

    Raises:
        StoreError: the run has none.
    """
    import xarray as xr

    path = folder / FOLDER / f"{key}.nc"
    if not path.exists():
        raise StoreError(f"run {key} has no time histories in {folder}")
    with xr.open_dataset(path, engine="scipy") as data:
        return data.load()

"""Time histories of older campaigns: `histories/<key>.nc` beside the database, one netCDF 3 file per run."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from workbench.models.histories import History

__all__ = ["former_files", "former_histories"]

FOLDER = "histories"


def former_files(folder: Path) -> list[Path]:
    """Those files of the campaign in `folder`."""
    return sorted((folder / FOLDER).glob("*.nc"))


def former_histories(folder: Path, key: str) -> Mapping[str, tuple[History, str]]:
    """History and unit by name; empty without a file that can be read."""
    from scipy.io import netcdf_file

    path = folder / FOLDER / f"{key}.nc"
    found = {}
    try:
        with netcdf_file(path, "r", mmap=False) as file:
            for name, variable in file.variables.items():
                times = file.variables.get(f"time_{name}")
                if times is not None:
                    unit = getattr(variable, "units", b"1").decode()
                    rows = (np.array(cells[:], dtype=np.float64) for cells in (times, variable))
                    found[str(name)] = (History.of(*rows), unit)
    except (OSError, ValueError, TypeError):
        return {}
    return found

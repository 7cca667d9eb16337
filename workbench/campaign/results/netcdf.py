"""`results.nc`: parameters, responses, status and batch of runs over the dimension `run`, by columns.

netCDF 3 with 64-bit offsets, which every netCDF library reads. The file is the one that xarray writes of the
Dataset of the same runs, byte for byte; here no run is held but as its cells in the file, 8 bytes a number.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from workbench.models.stored.run_chunks import RunChunk
from workbench.space.box import Response, Space
from workbench.system.atomic import replacing

__all__ = ["RunColumns"]

NUMBER = ">f8"  # high byte first, as netCDF stores it


class RunColumns:
    """The columns of `results.nc`, filled chunk by chunk and then written, once."""

    def __init__(self, space: Space, responses: Sequence[Response], *, name: str) -> None:
        self._attributes = {"study": name, "space_hash": space.hash}
        self._numeric = {p.name: p.is_numeric for p in space.parameters}
        self._about: dict[str, dict[str, str]] = {}
        for p in space.parameters:
            self._about[p.name] = {"units": p.unit, "role": "parameter", "long_name": p.label or p.name}
        for r in responses:
            self._about[r.name] = {"units": r.unit, "role": "response", "long_name": r.label or r.name}
        self._parts: dict[str, list[np.ndarray]] = {}
        for name in (*self._about, "status", "batch", "run"):
            is_number = name in self._about and self._numeric.get(name, True)
            self._parts[name] = [np.zeros(0, dtype=NUMBER if is_number else "S1")]
        self._count = 0

    def take(self, chunk: RunChunk) -> None:
        """Add the runs of a chunk."""
        self._count += len(chunk.ids)
        for name, part in self._cells(chunk):
            self._parts[name].append(part)

    def _cells(self, chunk: RunChunk) -> Iterator[tuple[str, np.ndarray]]:
        for name in self._about:
            is_numeric = self._numeric.get(name)
            if is_numeric is None:
                yield name, np.array([found.get(name, math.nan) for found in chunk.outputs], dtype=NUMBER)
            elif is_numeric:
                yield name, np.array([given[name] for given in chunk.inputs], dtype=NUMBER)
            else:
                yield name, _bytes([str(given[name]) for given in chunk.inputs])
        yield "status", _bytes(chunk.statuses)
        yield "batch", _bytes(chunk.batches)
        yield "run", _bytes(chunk.keys)

    def write(self, path: Path) -> None:
        """Write the file; the columns are empty afterwards."""
        from scipy.io import netcdf_file

        with replacing(path) as stream:
            file = netcdf_file(stream, "w", version=2)
            for name, text in self._attributes.items():
                setattr(file, name, text.encode())
            file.createDimension("run", self._count)
            for name, about in [*self._about.items(), ("status", {}), ("batch", {}), ("run", {})]:
                cells = np.concatenate(self._parts.pop(name))
                _add(file, name, cells, about)
            file.flush()


def _bytes(texts: Sequence[str]) -> np.ndarray:
    """UTF-8, as wide as the longest."""
    return np.array([text.encode() for text in texts], dtype=np.bytes_)


def _add(file: Any, name: str, cells: np.ndarray, about: dict[str, str]) -> None:
    """A variable over `run`: numbers, or characters of texts."""
    if cells.dtype.kind == "S":
        width = cells.dtype.itemsize
        if f"string{width}" not in file.dimensions:
            file.createDimension(f"string{width}", width)
        variable = file.createVariable(name, "c", ("run", f"string{width}"))
        variable[:] = cells.view("S1").reshape(len(cells), width)
    else:
        variable = file.createVariable(name, "f8", ("run",))
        variable[:] = cells
    for attribute, text in about.items():
        setattr(variable, attribute, text.encode())
    if cells.dtype.kind == "S":
        variable._Encoding = b"utf-8"
    else:
        variable._FillValue = np.float64(np.nan)

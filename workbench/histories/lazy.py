"""Histories of many runs as an xarray Dataset whose values are read when they are asked for."""

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from workbench.histories.stack import HistoryStack

__all__ = ["lazy_dataset"]


class _Rows(BackendArray):
    """The values of a stack; xarray asks for what a selection needs."""

    def __init__(self, stack: HistoryStack) -> None:
        self.stack = stack
        self.shape = stack.shape
        self.dtype = np.dtype(float)

    def __getitem__(self, key: Any) -> Any:
        """What a selection of xarray's needs."""
        support = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, support, self._read)

    def _read(self, key: tuple[Any, ...]) -> np.ndarray:
        axes = [np.arange(size)[one] for size, one in zip(self.shape, key, strict=True)]
        rows, columns = (np.atleast_1d(axis) for axis in axes)
        found = self.stack.values(rows, columns)
        return found.reshape([len(axis) for axis in axes if np.ndim(axis)])


def lazy_dataset(stack: HistoryStack) -> xr.Dataset:
    """The stack over `run` (keys) and `time`; the unit stands in the attributes."""
    values = indexing.LazilyIndexedArray(_Rows(stack))
    return xr.Dataset(
        {stack.name: xr.Variable(("run", "time"), values, {"units": stack.unit, "long_name": stack.name})},
        coords={"run": np.array(stack.keys, dtype=str), "time": stack.times},
    )

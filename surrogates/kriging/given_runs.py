"""Labels as codes, and what the runs of a fit may not hold: text, missing values, infinity.

scikit-learn says that there is a NaN; here the run is named.
"""

from collections.abc import Hashable, Iterable, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["LabelCodes", "check_finite", "check_response", "refuse_text"]

Array = NDArray[np.float64]

LARGEST = 1e150  # a variance is the square of it


class LabelCodes:
    """Codes of the labels in categorical columns; a label never seen gets a code that no run has.

    A DataFrame stays one, with the names of its columns.
    """

    def __init__(self, columns: Sequence[int], X: ArrayLike) -> None:
        self.codes: dict[int, dict[Any, float]] = {}
        table = np.array(X, dtype=object)
        if table.ndim != 2:
            return
        d = table.shape[1]
        for k in columns:
            if isinstance(k, bool) or not isinstance(k, Integral):
                raise ValueError(f"categorical needs column numbers from 0 to {d - 1}, got {k!r}")
            if not -d <= k < d:
                raise ValueError(f"categorical needs columns below {d}, got {k}")
            found = sorted(set(_labels(table, int(k) % d)), key=lambda label: (str(type(label)), label))
            self.codes[int(k) % d] = {label: float(code) for code, label in enumerate(found)}

    def __call__(self, X: Any) -> Any:
        """X with codes in place of labels."""
        table = np.array(X, dtype=object)
        if table.ndim != 2:
            return np.asarray(X)
        coded = X.copy() if hasattr(X, "isetitem") else None
        for k, codes in self.codes.items():
            if k < table.shape[1]:
                labels = _labels(table, k)
                new = [label for label in dict.fromkeys(labels) if label not in codes]
                unseen = {label: -1.0 - i for i, label in enumerate(new)}
                table[:, k] = [codes[v] if v in codes else unseen[v] for v in labels]
                if coded is not None:
                    coded.isetitem(k, table[:, k].astype(float))
        refuse_text(table)
        return table if coded is None else coded


def _labels(table: NDArray[Any], k: int) -> list[Any]:
    """The labels in column k; a ValueError names the first run that has none."""
    labels: list[Any] = table[:, k].tolist()
    for i, label in enumerate(labels):
        if _is_missing(label):
            raise ValueError(
                f"column {k} holds {label} in run {i} where a label should be: leave the run out, or give "
                "what is missing a label of its own"
            )
    return labels


def _is_missing(label: Any) -> bool:
    try:
        return label is None or not bool(label == label) or (isinstance(label, Real) and abs(label) == np.inf)
    except TypeError:  # the missing value of pandas is neither true nor false
        return True


def refuse_text(X: Any) -> None:
    """Say which column holds text; arrays that are not of object or string type pass."""
    table = np.asarray(X)
    if table.ndim != 2 or table.dtype.kind not in "OUS":
        return
    for k in range(table.shape[1]):
        for i, value in enumerate(table[:, k].tolist()):
            if isinstance(value, str) and not _is_number(value):
                raise ValueError(
                    f"column {k} holds text ({value!r} in row {i}): name it in categorical=[{k}] or encode it"
                )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def check_response(y: Any, names: Sequence[Hashable] | None = None) -> None:
    """Raise a ValueError that names the first run without a finite number; shapes are left to others.

    Args:
        y: (n,) or (n, q) in whatever container.   names: of the runs; 0, 1, ... by default.
    """
    values = np.asarray(y)
    if values.ndim == 0 or len(values) == 0 or values.dtype.kind not in "fOUS":
        return
    called = range(len(values)) if names is None else names
    if values.dtype.kind != "f":
        for name, row in zip(called, values.reshape(len(values), -1).tolist(), strict=False):
            for value in row:
                if value is None or (isinstance(value, str) and not _is_number(value)):
                    raise ValueError(f"y holds {value!r} in run {name}, not a number: leave failed runs out")
        try:
            values = values.astype(float)
        except (TypeError, ValueError):
            return  # nothing a response could be: scikit-learn says so
    check_finite(np.zeros((len(values), 0)), values, called)
    size = np.abs(values.reshape(len(values), -1)).max(axis=1, initial=0.0)
    if size.max() > LARGEST:
        i = int(size.argmax())
        raise ValueError(
            f"y holds a number of the size {size[i]:.0e} in run {list(called)[i]}, whose variance overflows: "
            f"give the response in a larger unit, so that it stays below {LARGEST:.0e}"
        )


def check_finite(x: Array, y: Array, names: Iterable[Hashable]) -> None:
    """Raise a ValueError that names the first run with a NaN or an infinity."""
    for name, values in (("X", x), ("y", y.reshape(len(y), y[:1].size))):
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            i, k = bad[0]
            what = "NaN" if np.isnan(values[i, k]) else "infinity"
            where = f" in column {k}" if name == "X" else ""
            rows = len(set(bad[:, 0].tolist()))
            raise ValueError(
                f"{name} holds {what} in run {list(names)[i]}{where} ({rows} of {len(values)} runs are not "
                "finite): leave failed runs out"
            )


def run_names(run_ids: Sequence[Hashable] | None, n: int) -> tuple[Hashable, ...]:
    """The names of n runs; 0, 1, ... without `run_ids`. Raises ValueError for another number of them."""
    if run_ids is None:
        return tuple(range(n))
    if len(run_ids) != n:
        raise ValueError(f"run_ids needs one entry per run, got {len(run_ids)} for {n} runs")
    return tuple(run_ids)

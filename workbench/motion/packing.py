"""Arrays as text in a document: base64 of little-endian numbers, enough to look at.

packed(values)            float32
packed_in_steps(values)   uint16 in equal steps between the smallest and the largest value of each column:
                          half the size, an error of at most 1/131070 of the range of the column
in_six(poses)             x, y, z and a unit quaternion as six numbers a pose: its sign says nothing, and of
                          the half with w >= 0 the modified Rodrigues parameters v/(1 + w) lie within one,
                          equally exact everywhere, where w = sqrt(1 - |v|^2) is not at half turns
"""

from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "STEPS",
    "in_six",
    "packed",
    "packed_in_steps",
    "unpacked",
    "unpacked_from_steps",
    "with_quaternions",
]

STEPS = 65535  # between the ends of a column's range


def packed(array: ArrayLike) -> str:
    """Numbers as float32.

    >>> unpacked(packed([0.5, -2.0])).tolist()
    [0.5, -2.0]
    """
    return b64encode(np.ascontiguousarray(array, dtype="<f4").tobytes()).decode()


def unpacked(text: str) -> NDArray[np.float64]:
    """The flat numbers of `packed`."""
    return np.frombuffer(b64decode(text), dtype="<f4").astype(float)


def packed_in_steps(array: NDArray[np.float64]) -> dict[str, Any]:
    """Columns of a table (rows, columns): "low" and "step" per column, and the steps from there.

    >>> document = packed_in_steps(np.array([[0.0, 5.0], [1.0, 5.0], [0.25, 5.0]]))
    >>> unpacked_from_steps(document).round(4).tolist()
    [[0.0, 5.0], [1.0, 5.0], [0.25, 5.0]]
    """
    low = _short(array.min(axis=0) if len(array) else np.zeros(array.shape[1]))
    # a little longer than needed: the numbers are written with nine digits, and counted from these
    step = _short((1.0 + 1e-8) * (array.max(axis=0) - low) / STEPS if len(array) else 0.0 * low)
    step = np.where(step > 0.0, step, 0.0)
    steps = np.clip(np.rint((array - low) / np.where(step > 0.0, step, 1.0)), 0, STEPS)
    text = b64encode(np.ascontiguousarray(steps, dtype="<u2").tobytes()).decode()
    return {"low": low.tolist(), "step": step.tolist(), "steps": text}


def _short(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Nine digits of each."""
    return np.array([float(f"{value:.9g}") for value in values])


def unpacked_from_steps(document: Mapping[str, Any]) -> NDArray[np.float64]:
    """The table of `packed_in_steps`, (rows, columns)."""
    low, step = np.array(document["low"]), np.array(document["step"])
    steps = np.frombuffer(b64decode(document["steps"]), dtype="<u2").reshape(-1, len(low))
    return np.asarray(low + step * steps)


def in_six(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (..., 7) as (..., 6): x, y, z and the modified Rodrigues parameters.

    >>> in_six(np.array([1.0, 2.0, 3.0, -0.6, 0.0, 0.0, 0.8])).round(9).tolist()
    [1.0, 2.0, 3.0, -0.0, -0.0, -0.5]
    """
    q = np.where(poses[..., 3:4] < 0.0, -1.0, 1.0) * poses[..., 3:]
    return np.concatenate([poses[..., :3], q[..., 1:] / (1.0 + q[..., :1])], axis=-1)


def with_quaternions(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (..., 7), w >= 0, of those of `in_six`.

    >>> with_quaternions(np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.5])).tolist()
    [1.0, 2.0, 3.0, 0.6, 0.0, 0.0, 0.8]
    """
    turn = poses[..., 3:]
    square = (turn**2).sum(axis=-1, keepdims=True)
    return np.concatenate(
        [poses[..., :3], (1.0 - square) / (1.0 + square), 2.0 * turn / (1.0 + square)], axis=-1
    )

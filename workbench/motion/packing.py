"""Arrays as text in a document: base64 of little-endian numbers, enough to look at.

packed(values)            float32
packed_in_steps(values)   whole numbers 0 to 65535 in equal steps between the smallest and the largest value
                          of each column, an error of at most 1/131070 of the range of the column; of them
                          the differences of first, second or no order over time, by what deflate makes short
in_six(poses)             x, y, z and a unit quaternion as six numbers a pose: its sign says nothing, and of
                          the half with w >= 0 the modified Rodrigues parameters v/(1 + w) lie within one,
                          equally exact everywhere, where w = sqrt(1 - |v|^2) is not at half turns

Differences are taken modulo 65536, column after column, and the low bytes of all stand before the high bytes:
what moves smoothly has high bytes that are nearly all alike.
"""

import zlib
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
ORDERS = (0, 1, 2)  # of differences
RAW = -15  # zlib's word for deflate without a head, which the page would only skip


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
    least = array.min(axis=0) if len(array) else np.zeros(array.shape[1])
    most = array.max(axis=0) if len(array) else least
    # as they are written, in float32: from these the steps are counted
    low = np.nextafter(least.astype("<f4"), np.float32(-np.inf)).astype(float)
    low = np.where(least.astype("<f4") <= least, least.astype("<f4"), low)
    step = ((1.0 + 1e-6) * (most - low) / STEPS).astype("<f4").astype(float)
    step = np.where(most > least, step, 0.0)
    steps = np.clip(np.rint((array - low) / np.where(step > 0.0, step, 1.0)), 0, STEPS).astype(np.int64)
    made = {order: _deflated(steps, order) for order in ORDERS}
    order = min(made, key=lambda k: len(made[k]))
    return {
        "low": packed(low), "step": packed(step), "order": order,
        "differences": b64encode(made[order]).decode(),
    }  # fmt: skip


def _deflated(steps: NDArray[np.int64], order: int) -> bytes:
    for _ in range(order):
        steps = np.concatenate([steps[:1], np.diff(steps, axis=0)])
    planes = np.ascontiguousarray(steps.T % (STEPS + 1), dtype="<u2").view(np.uint8).reshape(-1, 2).T
    deflate = zlib.compressobj(9, zlib.DEFLATED, RAW)
    return deflate.compress(planes.tobytes()) + deflate.flush()


def unpacked_from_steps(document: Mapping[str, Any]) -> NDArray[np.float64]:
    """The table of `packed_in_steps`, (rows, columns), or of the plain steps that were written before."""
    if "steps" in document:
        low, step = np.array(document["low"]), np.array(document["step"])
        steps = np.frombuffer(b64decode(document["steps"]), dtype="<u2").reshape(-1, len(low))
        return np.asarray(low + step * steps)
    low, step = unpacked(document["low"]), unpacked(document["step"])
    planes = np.frombuffer(zlib.decompress(b64decode(document["differences"]), RAW), dtype=np.uint8)
    found = planes.reshape(2, -1).astype(np.int64)
    table = (found[0] + 256 * found[1]).reshape(len(low), -1).T if len(low) else np.zeros((0, 0))
    for _ in range(document["order"]):
        table = np.cumsum(table, axis=0)
    return np.asarray(low + step * (table % (STEPS + 1)))


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

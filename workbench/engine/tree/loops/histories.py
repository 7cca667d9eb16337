"""Cut joints along a run of a tree: what they carry, how well they hold, and their slopes at the start."""

from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from ...integration.points import PointMotion
from .._kernels.cuts import DISTANCE, TURN

__all__ = ["CutForce", "acceleration_slopes", "cut_force", "cut_gaps"]

Array = np.ndarray[Any, Any]


class CutForce(NamedTuple):
    """Force (N) and moment (N m) of a cut joint on body `a` at its point, (steps + 1, 3) in global axes."""

    force: Array
    moment: Array


def _vectors(trajectory: Any, row: Any) -> tuple[Array, Array]:
    """(steps + 1, 3) of a condition: p - s or the direction on a, and the direction on b."""
    rows, pair = trajectory.parts.cut_rows, trajectory.tables.pair
    number, kind = rows.table[row]
    turn, origin, _, _ = trajectory.links()
    a, b = pair[number, 0], pair[number, 1]
    turn_a, turn_b = (turn[:, link].reshape(-1, 3, 3) for link in (a, b))
    x = turn_a @ rows.place[row, :3]
    if kind != TURN:
        x = x + origin[:, a] - origin[:, b] - turn_b @ rows.place[row, 3:6]
    return x, turn_b @ rows.place[row, 6:9]


def cut_gaps(trajectory: Any) -> Array:
    """(steps + 1, m) how far all conditions are from being met, those set aside among them; m or rad."""
    rows = trajectory.parts.cut_rows
    out = np.empty((len(trajectory.times), len(rows.table)))
    for row, (_, kind) in enumerate(rows.table):
        x, e = _vectors(trajectory, row)
        out[:, row] = (
            np.linalg.norm(x, axis=1) - rows.place[row, 9]
            if kind == DISTANCE
            else np.einsum("ti,ti->t", x, e)
        )
    return out


def cut_force(trajectory: Any, name: str) -> CutForce:
    """What a cut joint does to its body `a`.

    Where conditions are redundant, those set aside carry nothing. Raises ValueError for a stranger.
    """
    parts = trajectory.parts
    labels = [cut.label for cut in parts.cuts]
    if name not in labels:
        raise ValueError(f"system has no cut joint '{name}'; it has {', '.join(labels) or 'none'}")
    force, moment = np.zeros((len(trajectory.times), 3)), np.zeros((len(trajectory.times), 3))
    kept = np.flatnonzero(parts.kept)
    for at, row in enumerate(kept):
        if labels[parts.cut_rows.joint[row]] != name:
            continue
        x, e = _vectors(trajectory, row)
        pull = trajectory.multiplier[:, at, None]
        kind = parts.cut_rows.table[row, 1]
        if kind == TURN:
            moment -= pull * np.cross(x, e)
        elif kind == DISTANCE:
            force -= pull * x / np.linalg.norm(x, axis=1)[:, None]
        else:
            force -= pull * e
    return CutForce(force, moment)


def acceleration_slopes(trajectory: Any) -> tuple[Array, Array]:
    """(m, n) slopes of phi'' by small motions and by velocities at the start."""
    tables, motion = trajectory.tables, trajectory.motion(0)
    ground = trajectory.place("ground")
    by_q, by_v = (np.zeros((len(tables.cut), trajectory.size)) for _ in range(2))

    def at(link: int, point: Array) -> PointMotion:
        moved: PointMotion = motion.point(replace(ground, link=link), point)
        return moved

    for row, (pair, kind) in enumerate(tables.cut):
        a, b = tables.pair[pair, 0], tables.pair[pair, 1]
        on_a, on_b, along = (tables.cut_place[row, i : i + 3] for i in (0, 3, 6))
        base = at(b, on_b)
        x = _less(at(a, on_a), at(a, np.zeros(3)) if kind == TURN else base)
        if kind == DISTANCE:
            by_q[row], by_v[row] = _length_slopes(x)
        else:
            by_q[row], by_v[row] = _product_slopes(x, _less(at(b, on_b + along), base))
    return by_q, by_v


def _less(a: PointMotion, b: PointMotion) -> PointMotion:
    return PointMotion(**{f.name: getattr(a, f.name) - getattr(b, f.name) for f in fields(PointMotion)})


def _product_slopes(x: PointMotion, e: PointMotion) -> tuple[Array, Array]:
    """Of (x . e)'' = x''.e + 2 x'.e' + x.e''."""
    by_q = x.acceleration_q @ e.place + e.acceleration_q @ x.place
    by_q += 2.0 * (x.velocity_q @ e.velocity + e.velocity_q @ x.velocity)
    by_q += x.place_q @ e.acceleration + e.place_q @ x.acceleration
    by_v = x.acceleration_v @ e.place + e.acceleration_v @ x.place
    return by_q, by_v + 2.0 * (x.place_q @ e.velocity + e.place_q @ x.velocity)


def _length_slopes(x: PointMotion) -> tuple[Array, Array]:
    """Of l'' = (x.x'' + x'.x' - l'^2)/l, l' = x.x'/l."""
    length = np.linalg.norm(x.place)
    rate = x.place @ x.velocity / length
    second = (x.place @ x.acceleration + x.velocity @ x.velocity - rate**2) / length
    length_q = x.place_q @ x.place / length
    rate_q = (x.place_q @ x.velocity + x.velocity_q @ x.place - rate * length_q) / length
    by_q = x.place_q @ x.acceleration + x.acceleration_q @ x.place + 2.0 * x.velocity_q @ x.velocity
    by_v = x.acceleration_v @ x.place + 2.0 * x.place_q @ x.velocity
    return (by_q - 2.0 * rate * rate_q - second * length_q) / length, (by_v - 2.0 * rate * length_q) / length

"""Grids of times: which are allowed, the lengths of their steps, and what generalised-alpha does where they
change.

Its auxiliary acceleration a belongs to a time beside its node's, by a share of the step. Where steps change
their length it is moved along, a <- w + s (a - w) with s = h/h_before: without that the order is 1 on steps
that change all the time. Next to joints of the index-3 form s multiplies what is left of the constrained
motion: alternating steps 1:3 grow by 1.02 a step at rho = 0.8. There a is moved along small changes alone.
"""

from typing import Any

import numpy as np

from ..errors import NotSupported

__all__ = ["changes_of", "checked_times", "is_even", "one_step_length", "step_changes", "step_lengths"]

Array = np.ndarray[Any, Any]

GRADUAL = 1.2  # ratio of neighbouring steps up to which a is moved along with joints; see decision 0170
EVEN = 1e-12  # of the latest time: rounding of equal steps


def checked_times(times: Any, *, begin: float = 0.0) -> Array:
    """(steps + 1,) times of nodes as a fresh array. ValueError unless they grow and start at `begin` s."""
    grid = np.array(times, dtype=float)
    if grid.ndim != 1 or len(grid) < 2:
        raise ValueError(f"times needs at least two nodes in a row, got shape {grid.shape}")
    if not np.isfinite(grid).all():
        raise ValueError(f"times needs finite values, got times[{int(np.argmin(np.isfinite(grid)))}]")
    if abs(grid[0] - begin) > EVEN * np.abs(grid).max():
        where = "0 s, where the system starts" if begin == 0.0 else f"{begin:.9g} s, where the start stands"
        raise ValueError(f"times needs to begin at {where}, got {grid[0]:.9g} s")
    grid[0] = begin
    short = np.flatnonzero(np.diff(grid) <= 0.0)
    if len(short):
        i = int(short[0])
        raise ValueError(f"times needs growing values, got {grid[i]:.9g} s, then {grid[i + 1]:.9g} s")
    return grid


def is_even(times: Array) -> bool:
    """Whether all steps have one length."""
    equal = np.linspace(times[0], times[-1], len(times))
    return bool(np.abs(times - equal).max() <= EVEN * np.abs(times).max())


def step_lengths(times: Array, before: float | None = None) -> Array:
    """(steps + 1,) length of the step that leads to each node, s; entry 0 repeats that of the first.

    Equal steps get one number, to the bit, whatever rounding did to their differences.
    before: length of the step that led to node 0 in an earlier run: then entry 0 is that, and equal steps as
    long as it get its number.
    """
    if is_even(times):
        first = float(times[1] - times[0])
        if before is not None and (len(times) - 1) * abs(first - before) <= EVEN * np.abs(times).max():
            first = before
        lengths = np.full(len(times), first)
    else:
        lengths = np.diff(times)
        lengths = np.concatenate([lengths[:1], lengths])
    if before is not None:
        lengths[0] = before
    return lengths


def step_changes(times: Array, *, joints: bool, before: float | None = None) -> Array:
    """(2, steps + 1) `step_lengths`, and the factor s of a before each step, 1 where it stays.

    joints: whether conditions of index 3 hold: then s = 1 where neighbouring steps differ by more than a
    fifth, and each such place is felt by O(h^2).
    before: as in `step_lengths`.
    """
    return changes_of(step_lengths(times, before), joints=joints)


def changes_of(lengths: Array, *, joints: bool) -> Array:
    """`step_changes` of steps whose lengths are known."""
    factor = np.ones(len(lengths))
    factor[1:] = lengths[1:] / lengths[:-1]
    if joints:
        factor[(factor > GRADUAL) | (factor * GRADUAL < 1.0)] = 1.0
    return np.array([lengths, factor])


def one_step_length(times: Array, what: str, before: float | None = None) -> float:
    """Length of the equal steps. NotSupported, naming what needs them, for a grid of unequal ones.

    before: length of the step that led to node 0 in an earlier run, which must be the same.
    """
    lengths = step_lengths(times, before)
    if not is_even(times) or (lengths != lengths[0]).any():
        raise NotSupported(f"{what} needs steps of one length; run with steps= instead of a grid of times")
    return float(lengths[-1])

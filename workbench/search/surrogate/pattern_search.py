"""Pattern search for the largest score in the unit cube, over continuous and levelled coordinates alike."""

from collections.abc import Callable, Sequence

import numpy as np

__all__ = ["Levels", "maximise_score", "trial_values"]

Score = Callable[[np.ndarray], np.ndarray]
Levels = Sequence[np.ndarray | None]  # per coordinate: the admissible unit values, or None for continuous

FINEST_STEP = 2e-4  # of the unit interval; far below what an engineer can set
FULL_ENUMERATION = 16  # levels up to this number are all tried at every sweep


def trial_values(u: np.ndarray, step: float, levels: Levels) -> list[np.ndarray]:
    """Per coordinate, the values to try next to u (d,): both neighbours at `step` and both ends, or every
    level where there are few.
    """
    moves = []
    for x, grid in zip(u, levels, strict=True):
        if grid is None:
            tried = np.array(sorted({max(float(x) - step, 0.0), min(float(x) + step, 1.0), 0.0, 1.0}))
        elif len(grid) <= FULL_ENUMERATION:
            tried = grid
        else:
            here = int(np.argmin(np.abs(grid - x)))
            stride = max(1, round(step * len(grid)))
            picks = {max(here - stride, 0), min(here + stride, len(grid) - 1), 0, len(grid) - 1}
            tried = grid[sorted(picks)]
        moves.append(tried[tried != x])
    return moves


def maximise_score(
    score: Score, starts: np.ndarray, levels: Levels, *, step: float = 0.2, sweeps: int = 60
) -> tuple[np.ndarray, np.ndarray]:
    """Pattern search from every row of `starts` (s, d) at once; returns the points (s, d) and scores (s,).

    A sweep tries each coordinate by itself, then all coordinates that gained together, and keeps the better;
    a start that gains nothing has its step divided by three. Works for continuous, levelled and categorical
    coordinates alike, and an infeasible point (score -inf) is never kept.
    """
    u = np.array(starts, dtype=float, ndmin=2)
    value = score(u)
    steps = np.full(len(u), step)
    for _ in range(sweeps):
        active = np.flatnonzero(steps > FINEST_STEP)
        if len(active) == 0:
            break
        block, owner, coordinate = [], [], []
        for i in active:
            for j, tried in enumerate(trial_values(u[i], float(steps[i]), levels)):
                moved = np.repeat(u[i][None], len(tried), axis=0)
                moved[:, j] = tried
                block.append(moved)
                owner += [i] * len(tried)
                coordinate += [j] * len(tried)
        if not block:
            break
        points = np.concatenate(block)
        scores = score(points)
        owners, coordinates = np.array(owner), np.array(coordinate)
        joint = u[active].copy()
        for k, i in enumerate(active):
            mine = np.flatnonzero(owners == i)
            for j in np.unique(coordinates[mine]):
                of_j = mine[coordinates[mine] == j]
                best = of_j[np.argmax(scores[of_j])]
                if scores[best] > value[i]:
                    joint[k, j] = points[best, j]
        joint_score = score(joint)
        for k, i in enumerate(active):
            mine = np.flatnonzero(owners == i)
            best = mine[np.argmax(scores[mine])] if len(mine) else None
            if best is not None and scores[best] > max(value[i], joint_score[k]):
                u[i], value[i] = points[best], scores[best]
            elif joint_score[k] > value[i]:
                u[i], value[i] = joint[k], joint_score[k]
            else:
                steps[i] /= 3
    return u, value

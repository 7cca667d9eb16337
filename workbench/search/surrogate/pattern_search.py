"""Where to run the model next: acquisition scores and their maximisation over mixed coordinates.

Notation: u point in the unit cube, m(u) and s(u) predicted mean and standard deviation of the quantity to be
maximised, b the best value seen, z = (m - b)/s.

    expected improvement    EI(u) = s (z Phi(z) + phi(z))            Jones, Schonlau and Welch 1998
    upper bound             UB(u) = m + k s

EI is handled by its logarithm, which neither underflows nor loses its slope far from the optimum.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import erfcx, log_ndtr

__all__ = ["Levels", "log_expected_improvement", "maximise_score", "proposals"]

Score = Callable[[np.ndarray], np.ndarray]
Levels = Sequence[np.ndarray | None]  # per coordinate: the admissible unit values, or None for continuous

FINEST_STEP = 2e-4  # of the unit interval; far below what an engineer can set
FULL_ENUMERATION = 16  # levels up to this number are all tried at every sweep


def log_expected_improvement(mean: np.ndarray, std: np.ndarray, best: float) -> np.ndarray:
    """log EI for arrays (n,); -inf where the standard deviation is zero and nothing is gained.

    >>> float(np.round(np.exp(log_expected_improvement(np.zeros(1), np.ones(1), 0.0))[0], 6))
    0.398942
    """
    std = np.maximum(std, 1e-100)
    z = (mean - best) / std
    log_phi = -0.5 * z * z - 0.5 * np.log(2 * np.pi)
    # z Phi + phi = phi (1 + z Phi/phi), and Phi/phi = sqrt(pi/2) erfcx(-z/sqrt 2), which stays finite for z
    # < 0
    low = z < -1
    inner = np.empty_like(z)
    inner[~low] = np.log(z[~low] * np.exp(log_ndtr(z[~low])) + np.exp(log_phi[~low]))
    tail = 1 + z[low] * np.sqrt(np.pi / 2) * erfcx(-z[low] / np.sqrt(2))
    # for very negative z the bracket cancels to 1/z^2
    tail = np.where(z[low] < -1e4, 1 / z[low] ** 2, np.maximum(tail, 1e-300))
    inner[low] = log_phi[low] + np.log(tail)
    return np.log(std) + inner


def proposals(u: np.ndarray, step: float, levels: Levels) -> list[np.ndarray]:
    """Per coordinate, the values to try next to u (d,): both neighbours at `step`, both ends; all of few
    levels.
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

    A sweep tries each coordinate by itself, then all coordinates that gained together, and keeps the
    better; a start that gains nothing halves its step. Works for continuous, levelled and categorical
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
            for j, tried in enumerate(proposals(u[i], float(steps[i]), levels)):
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

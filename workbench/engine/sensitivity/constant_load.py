"""Constant dynamic loading (chapter IV): the load at the critical time is frozen, its response static.

    K_s dq/dalpha = -dF/dalpha,   K_s = B^T K B - F_g^T dB/dq     (4.6)

with the transposes that (4.6) and (4.8) lose. It is not the gradient: in the studies its cosine with the
gradient is -0.98 when the maximum lies at the end of the window and +0.92 at a peak inside. In a free-free
system K_s is singular (two zero eigenvalues) where the text inverts it; the pseudo-inverse is taken, or some
bodies are held.
"""

from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory
from ..objectives.reductions import Objective
from .seeds import seeds

__all__ = ["constant_load"]

Array = np.ndarray[Any, Any]

SINGULAR = 1e-10  # singular values below this share of the largest are rigid motions


def constant_load(trajectory: AnyTrajectory, objective: Objective, *, held: tuple[str, ...] = ()) -> Array:
    """(N,) the estimate of dG/dalpha at the critical node; `held` bodies do not move in the static answer."""
    start = seeds(trajectory, objective)
    node, n = start.last, trajectory.position.shape[1]
    system = trajectory.linearised(method="constant loading")
    q, v = trajectory.position[node], trajectory.velocity[node]
    jacobian = system.tangents(node, q, v, trajectory.multiplier[node]).jacobian
    design = system.design(node, q, v)
    stiffness = system.member_stiffness(node, q, v)
    moving = np.ones(n, bool)
    for body in held:
        moving[trajectory.system.coordinate(body)] = False
    matrix = system.saddle(stiffness, jacobian)
    keep = np.concatenate([moving, np.ones(system.rows, bool)])
    load = start.position.sum(axis=0)
    right = np.concatenate([load, np.zeros(system.rows)])[keep]
    answer = np.zeros(n + system.rows)
    answer[keep] = np.linalg.pinv(matrix[np.ix_(keep, keep)].T, rcond=SINGULAR) @ right
    return np.asarray(start.density - answer[:n] @ design)

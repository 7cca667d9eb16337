"""Search among whole members in the few directions that the response sees.

Between rigid bodies the response sees the densities through a few sums (`outcome/purify.py`), whatever the
number of members. The gradients of the choices evaluated so far span these directions: their leading singular
vectors V turn a choice x into features V'x, in which a Gaussian process (Matern 5/2, log of the value) learns
from few simulations. Next is the choice of the largest expected improvement (Jones, Schonlau and Welch 1998)
among the steps beside the best choices, steps of two states, and random ones; every third look goes to the
swap that the adjoint scores of the best choice rate best. Once all steps beside the best choice were looked
at, it cannot be improved by one swap.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from .choices import Choices, On
from .evaluated import Evaluated

__all__ = ["response_space_search"]

Array = NDArray[np.float64]

_DIRECTIONS = 10
_STRENGTH = 1e-3  # of the largest singular value, below which a direction is not kept
_FIRST = 16  # random choices before the process is asked
_CANDIDATES = 3000
_AGAIN = 8  # evaluations after which lengths are chosen again
_LENGTHS = (0.5, 1.0, 2.0, 4.0)
_NOISE = (1e-6, 1e-4, 1e-2)  # variance that the directions do not explain
_NOTHING = 1e-6  # expected improvement, relative, that is not worth a simulation
_SIGMAS = 4.0  # standard deviations that a failed choice counts above the mean


def response_space_search(seen: Evaluated, choices: Choices, *, rng: np.random.Generator) -> bool:
    """Look at choices until the limit; True when every step beside the best one was looked at."""
    for _ in range(4 * _FIRST):
        if len(seen.values) >= min(_FIRST, seen.limit):
            break
        seen.look(choices.filled(rng.permutation(choices.states)))
    fit, since = None, _AGAIN
    while seen.left > 0:
        if not np.isfinite(seen.values).any():
            seen.look(choices.filled(rng.permutation(choices.states)))
            if len(seen.values) >= seen.limit or not _unseen(seen, choices, rng):
                break
            continue
        if len(seen.values) % 3 == 0 and (step := _by_adjoint(seen, choices)) is not None:
            seen.look(step)
            since += 1
            continue
        pool = _unseen(seen, choices, rng)
        if not pool:
            return True
        if since >= _AGAIN or fit is None:
            fit, since = _lengths(seen), 0
        improvement = _expected_improvement(seen, fit, np.array(pool, dtype=float))
        seen.look(pool[int(improvement.argmax())])
        since += 1
        if improvement.max() <= _NOTHING and all(on in seen for on in choices.beside(seen.on[seen.best])):
            return True
    return all(on in seen for on in choices.beside(seen.on[seen.best]))


def _by_adjoint(seen: Evaluated, choices: Choices) -> On | None:
    """The step beside the best choice whose worst case is the smallest to first order, if it is new."""
    place = seen.best
    slopes = seen.slopes[place]
    steps = [on for on in choices.beside(seen.on[place]) if on not in seen]
    if slopes is None or not steps:
        return None
    moves = np.array(steps, dtype=float) - seen.on[place]
    return steps[int((seen.tops[place] + moves @ slopes.T).max(axis=1).argmin())]


def _unseen(seen: Evaluated, choices: Choices, rng: np.random.Generator) -> list[On]:
    order = np.argsort(seen.values)[:4]
    pool = {on.tobytes(): on for place in order for on in choices.beside(seen.on[place])}
    near = list(pool.values())
    for on in near[:: max(1, len(near) // 40)]:  # two steps away
        beside = choices.beside(on)
        for k in rng.permutation(len(beside))[:25]:
            pool[beside[k].tobytes()] = beside[k]
    for _ in range(300):
        on = choices.filled(rng.permutation(choices.states))
        pool[on.tobytes()] = on
    return [on for key, on in list(pool.items())[:_CANDIDATES] if on not in seen]


def _directions(seen: Evaluated) -> Array:
    """(states, k): what the gradients seen so far span, each direction with its share of the strength."""
    table = np.vstack([
        s / max(float(np.abs(s).max()), 1e-300) for s in seen.slopes if s is not None
    ])  # fmt: skip
    strength, modes = np.linalg.svd(table, full_matrices=False)[1:]
    kept = strength > _STRENGTH * max(float(strength[0]), 1e-300)
    kept[_DIRECTIONS:] = False
    return np.asarray(modes[kept].T * np.sqrt(strength[kept] / strength[0]))


def _responses(seen: Evaluated) -> tuple[Array, float]:
    """Logarithms of the values (or values) from their mean in deviations, and the deviation."""
    values = np.array(seen.values)
    good = np.isfinite(values)
    y = np.log(values, where=good, out=np.zeros(len(values))) if (values[good] > 0).all() else values.copy()
    mean, spread = float(y[good].mean()), max(float(y[good].std()), 1e-12)
    return np.where(good, (y - mean) / spread, _SIGMAS), spread


def _kernel(a: Array, b: Array) -> Array:
    d = np.sqrt(5) * cdist(a, b)
    return np.asarray((1 + d + d**2 / 3) * np.exp(-d))


def _lengths(seen: Evaluated) -> tuple[Array, float]:
    """Directions over the length, and the noise, of the largest likelihood of a few."""
    V = _directions(seen)
    X = np.array(seen.on, dtype=float)
    y, _ = _responses(seen)
    unit = max(float(np.median(cdist(X @ V, X @ V))), 1e-300)
    found, best = (V / unit, _NOISE[1]), -np.inf
    for length in _LENGTHS:
        F = X @ V / (unit * length)
        K = _kernel(F, F)
        for noise in _NOISE:
            L = cholesky(K + noise * np.eye(len(y)), lower=True)
            z = cho_solve((L, True), y)
            scale = float(y @ z) / len(y)
            likelihood = -0.5 * len(y) * np.log(scale) - np.log(np.diag(L)).sum()
            if likelihood > best:
                found, best = (V / (unit * length), noise), likelihood
    return found


def _expected_improvement(seen: Evaluated, fit: tuple[Array, float], pool: Array) -> Array:
    """Of the value relative to the best, for choices (p, states)."""
    V, noise = fit
    y, spread = _responses(seen)
    F, P = np.array(seen.on, dtype=float) @ V, pool @ V
    L = cholesky(_kernel(F, F) + noise * np.eye(len(y)), lower=True)
    z = cho_solve((L, True), y)
    cross = _kernel(P, F)
    scale = float(y @ z) / len(y)
    variance = 1.0 + noise - np.einsum("pi,ip->p", cross, cho_solve((L, True), cross.T))
    s = np.sqrt(scale * np.maximum(variance, 1e-12))
    u = (y.min() - cross @ z) / s
    return np.asarray(spread * s * (u * ndtr(u) + np.exp(-0.5 * u**2) / np.sqrt(2 * np.pi)))

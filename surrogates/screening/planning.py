"""How many runs does a screening need? Recovery rates by simulation on functions like the user's.

Loeppky, Sacks & Welch (Technometrics 51, 2009, 366-376) advise 10 d runs for prediction; to tell the k
active of d inputs, what counts is k and how they act. `random_function` draws functions with k active
inputs of unequal weight, curved and interacting; `recovery` screens samples of growing size and counts how
often exactly the active set is selected.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kriging.validation import NORMAL_975
from .screener import KrigingScreener

__all__ = ["Recovery", "random_function", "recovery", "wilson_interval"]

Array = NDArray[np.float64]
Sampler = Callable[[int, int, np.random.Generator], Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """How often a screening of n runs found what there was to find.

    Attributes:
        n: runs.   trials: simulated screenings.
        exact: share with exactly the active set; `exact_interval` its 95 % Wilson interval.
        first: share in which the k first of the ranking are the active ones.
        missed, false: mean number of active inputs missed, of inert inputs selected.
        resolved: share called resolved.
        exact_when_resolved: share of exact ones among them; nan if there are none.
    """

    n: int
    trials: int
    exact: float
    exact_interval: tuple[float, float]
    first: float
    missed: float
    false: float
    resolved: float
    exact_when_resolved: float


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson, J. Am. Stat. Assoc. 22, 1927, 209-212).

    >>> [round(v, 2) for v in wilson_interval(7, 60)]
    [0.06, 0.22]
    """
    z2, p = NORMAL_975**2, successes / trials
    centre = (p + z2 / (2 * trials)) / (1 + z2 / trials)
    half = NORMAL_975 / (1 + z2 / trials) * np.sqrt(p * (1 - p) / trials + z2 / (4 * trials**2))
    # 0 and all successes have an end exactly at 0 and 1
    low = 0.0 if successes == 0 else float(centre - half)
    return low, 1.0 if successes == trials else float(centre + half)


def random_function(
    k: int, *, curved: float = 0.5, interacting: float = 0.3, rng: np.random.Generator
) -> Callable[[Array], Array]:
    """A smooth function of k inputs in [0, 1], all of them active, that takes (n, k) and returns (n,).

    Each input acts with a weight between 1/4 and 1: linearly, or with probability `curved` as half to one
    and a half waves; a share `interacting` of the inputs also multiplies another one. Scaled to unit
    standard deviation over the cube.
    """
    if k < 1:
        raise ValueError(f"k needs at least 1 active input, got {k}")
    weight = rng.uniform(0.25, 1.0, k) * rng.choice([-1.0, 1.0], k)
    wave = np.where(rng.random(k) < curved, rng.uniform(0.5, 1.5, k), 0.0)
    phase = rng.uniform(0, 2 * np.pi, k)
    pairs = [(i, int(rng.integers(k))) for i in range(k) if k > 1 and rng.random() < interacting]
    strength = rng.uniform(0.5, 1.0, len(pairs))

    def raw(x: Array) -> Array:
        each = np.where(wave > 0, np.sin(2 * np.pi * wave * x + phase) * np.sqrt(2), np.sqrt(12) * (x - 0.5))
        y = each @ weight
        for (i, j), s in zip(pairs, strength, strict=True):
            if i != j:
                y = y + s * 12 * (x[:, i] - 0.5) * (x[:, j] - 0.5)
        return np.asarray(y)

    scale = float(raw(rng.random((2000, k))).std())
    return lambda x: raw(x) / scale


def recovery(
    d: int,
    k: int,
    runs: Sequence[int],
    *,
    sampler: Sampler,
    noise: float = 0.0,
    trials: int = 20,
    function: Callable[[Array], Array] | None = None,
    rng: np.random.Generator,
) -> list[Recovery]:
    """Screen `trials` simulated problems of d inputs with k active ones for each number of runs.

    >>> def uniform(n, d, rng):
    ...     return rng.random((n, d))
    >>> r = recovery(6, 2, [12, 40], sampler=uniform, trials=4, rng=np.random.default_rng(0))
    >>> [x.n for x in r], r[1].first
    ([12, 40], 1.0)

    Args:
        sampler: called with (n, d, rng), returns (n, d) in [0, 1].
        noise: standard deviation relative to that of the response.
        function: of the k active inputs, (n, k) -> (n,); a new `random_function` for every trial by default.
    """
    if not 1 <= k <= d:
        raise ValueError(f"k active of d inputs needs 1 <= k <= d, got k={k} and d={d}")
    if trials < 1:
        raise ValueError(f"trials needs at least 1, got {trials}")
    problems = [
        (random_function(k, rng=rng) if function is None else function, rng.permutation(d)[:k])
        for _ in range(trials)
    ]
    return [_recovered(n, d, problems, sampler, noise, rng) for n in runs]


def _recovered(
    n: int,
    d: int,
    problems: Sequence[tuple[Callable[[Array], Array], NDArray[np.intp]]],
    sampler: Sampler,
    noise: float,
    rng: np.random.Generator,
) -> Recovery:
    rows = []
    for f, active in problems:
        x = sampler(n, d, rng)
        y = f(x[:, active])
        y = y + noise * y.std() * rng.standard_normal(n)
        screener = KrigingScreener().fit(x, y)
        found, true = set(screener.selected_.tolist()), set(active.tolist())
        first = set(screener.ranking_[: len(true)].tolist()) == true
        rows.append(
            (found == true, first, len(true - found), len(found - true), screener.diagnosis_.resolved)
        )
    exact, firsts, missed, false, resolved = (np.array(c, dtype=float) for c in zip(*rows, strict=True))
    return Recovery(
        n=n,
        trials=len(rows),
        exact=float(exact.mean()),
        exact_interval=wilson_interval(int(exact.sum()), len(rows)),
        first=float(firsts.mean()),
        missed=float(missed.mean()),
        false=float(false.mean()),
        resolved=float(resolved.mean()),
        exact_when_resolved=float(exact[resolved == 1].mean()) if resolved.any() else float("nan"),
    )

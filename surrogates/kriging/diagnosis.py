"""What a fit found out about its data and itself: one record instead of warnings."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Diagnosis", "advise", "close_pairs", "constant_columns", "repeated_columns", "varying"]

Array = NDArray[np.float64]
Pair = tuple[Hashable, Hashable]

NEAR = 1e-6  # distance in the box of width 1 below which two runs are near-duplicates
ILL_CONDITIONED = 1e12
POOR_Q2 = 0.5
GOOD_Q2 = 0.9
# of random functions with a third of their inputs active, at 2 runs per input half have a true Q2 that is 0.2
# lower than that of leave-one-out, at 3 one in four, at 5 hardly any
TRUSTED_RUNS_PER_INPUT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """Facts about one fit. Inputs are named by their column, 0-based; runs by their run id.

    Attributes:
        n_runs, n_inputs, n_trend_terms: sizes.
        condition_number: of the correlation matrix with its nugget (1-norm estimate).
        duplicates: pairs of runs with equal inputs; `unequal_duplicates` those with different responses.
        near_duplicates: pairs closer than 1e-6 of the box that are not equal.
        constant_inputs: columns that cannot matter.
        repeated_inputs: pairs of columns that cannot be told apart.
        dropped_trend_terms: terms left out because the runs cannot tell them from the others.
        nugget: used, relative to sigma^2; `nugget_estimated` whether the likelihood chose it.
        at_lower_bound, at_upper_bound: inputs whose theta sits on its bound.
        n_starts, n_starts_agreeing: ascents made, and how many ended within 0.05 of the best.
        gap_to_second: fall of the log-likelihood to the second optimum; nan when all starts agree.
        evaluations: of the likelihood. `converged`: whether the best ascent stopped by itself.
        q2, coverage95: of the leave-one-out predictions.
        interval_factor: what cross-validation scaled the intervals by; 1 when not asked for.
        degenerate: the trend alone reproduces the response, sigma^2 is zero.
        advice: what to do about it, in words.
    """

    n_runs: int
    n_inputs: int
    n_trend_terms: int
    condition_number: float
    duplicates: tuple[Pair, ...]
    unequal_duplicates: tuple[Pair, ...]
    near_duplicates: tuple[Pair, ...]
    constant_inputs: tuple[int, ...]
    repeated_inputs: tuple[tuple[int, int], ...]
    dropped_trend_terms: tuple[str, ...]
    nugget: float
    nugget_estimated: bool
    at_lower_bound: tuple[int, ...]
    at_upper_bound: tuple[int, ...]
    n_starts: int
    n_starts_agreeing: int
    gap_to_second: float
    evaluations: int
    converged: bool
    q2: float
    coverage95: float
    degenerate: bool
    interval_factor: float = 1.0
    advice: str = ""


def close_pairs(x: Array, *, near: float = NEAR) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Equal and nearly equal pairs of rows (i < j) of x (n, d) scaled to a box of width 1.

    >>> import numpy as np
    >>> close_pairs(np.array([[0.1], [0.5], [0.1], [0.5 + 1e-9]]))
    ([(0, 2)], [(1, 3)])
    """
    # equal or near rows have near first coordinates, so only neighbours in that order are compared
    order = np.lexsort(x.T[::-1])
    z = x[order]
    equal: list[tuple[int, int]] = []
    nearly: list[tuple[int, int]] = []
    offset, open_rows = 1, np.arange(len(x) - 1)
    while len(open_rows):
        gap = z[open_rows + offset, 0] - z[open_rows, 0]
        open_rows = open_rows[gap <= near]
        distance = np.sqrt(((z[open_rows + offset] - z[open_rows]) ** 2).sum(axis=1))
        for i, length in zip(open_rows[distance <= near], distance[distance <= near], strict=True):
            a, b = sorted((int(order[i]), int(order[i + offset])))
            (equal if length == 0.0 else nearly).append((a, b))
        offset += 1
        open_rows = open_rows[open_rows + offset < len(x)]
    return sorted(equal), sorted(nearly)


def varying(x: Array) -> NDArray[np.bool_]:
    """(d,) which columns of x (n, d) change; a spread of rounding size is none: 1e9 + 1e-7 does not change.

    >>> import numpy as np
    >>> varying(np.array([[0.3, 0.0], [0.1 + 0.2, 1e-9]]))
    array([False,  True])
    """
    low, high = x.min(axis=0), x.max(axis=0)
    return np.asarray(high - low > 1e-12 * np.maximum(np.abs(low), np.abs(high)))


def constant_columns(x: Array) -> tuple[int, ...]:
    """Columns of x that never change."""
    return tuple(int(k) for k in np.flatnonzero(~varying(x)))


def repeated_columns(x: Array) -> tuple[tuple[int, int], ...]:
    """Pairs of columns of x (scaled to width 1, centred) that are equal, or equal with the sign turned."""
    # two runs make every column equal
    live = [k for k in range(x.shape[1]) if np.ptp(x[:, k]) > 0.0 and len(x) > 2]
    found = []
    for a, k in enumerate(live):
        rest = np.array(live[a + 1 :], dtype=np.intp)
        if not len(rest):
            break
        same = np.abs(x[:, rest] - x[:, [k]]).max(axis=0) < 1e-12
        turned = np.abs(x[:, rest] + x[:, [k]]).max(axis=0) < 1e-12
        found += [(k, int(other)) for other in rest[same | turned]]
    return tuple(found)


def advise(d: Diagnosis) -> str:
    """Sentences of advice for a diagnosis, the most serious first."""
    said = []
    if d.degenerate:
        said.append("the trend alone reproduces every response, so there is nothing left to model")
    if d.unequal_duplicates and not d.nugget_estimated and d.nugget < 1e-3:
        said.append(
            f"runs {_pair(d.unequal_duplicates[0])} have equal inputs and different responses: "
            "set nugget='estimate' or give the noise of the runs"
        )
    if d.condition_number > ILL_CONDITIONED:
        said.append("the correlation matrix is close to singular: set nugget=1e-6 or a rougher correlation")
    if not d.converged and not d.degenerate:
        said.append("the search stopped before it converged: give more starts")
    if d.n_starts > 1 and d.n_starts_agreeing == 1 and not d.degenerate:
        said.append(f"only one of {d.n_starts} starts reached the best optimum: give more starts")
    varied = d.n_inputs - len(d.constant_inputs)
    if d.n_starts and np.isfinite(d.q2) and d.n_runs < TRUSTED_RUNS_PER_INPUT * varied:
        said.append(
            f"{d.n_runs} runs are few for {varied} thetas that were fitted to them, so leave-one-out "
            f"flatters (Q2 {d.q2:.2f}) and new points may be predicted far worse: come to "
            f"{TRUSTED_RUNS_PER_INPUT * varied} runs, screen the inputs first, give theta_prior, or judge by "
            "runs that were not used"
        )
    if np.isfinite(d.q2) and d.q2 < POOR_Q2:
        cure = "more runs, a trend, or nugget='estimate' if the response is noisy"
        said.append(f"leave-one-out Q2 is {d.q2:.2f}: do not rely on predictions; try {cure}")
    if d.at_upper_bound and not d.degenerate:
        said.append(
            f"theta of input {_columns(d.at_upper_bound)} sits on its upper bound: the response looks like "
            "noise along it; more runs or an estimated nugget would tell"
        )
    if np.isfinite(d.coverage95) and d.coverage95 < 0.8:
        said.append(
            f"the 95 % intervals hold only {100 * d.coverage95:.0f} % of the left-out runs: they are too "
            "narrow"
        )
    if d.near_duplicates and d.nugget < 1e-10:
        said.append(f"runs {_pair(d.near_duplicates[0])} are nearly equal: set nugget=1e-8")
    if d.repeated_inputs:
        a, b = d.repeated_inputs[0]
        said.append(f"inputs {a} and {b} carry the same values, their effects cannot be told apart")
    if d.constant_inputs:
        said.append(f"input {_columns(d.constant_inputs)} never changes, nothing is learned about it")
    if d.dropped_trend_terms:
        said.append(f"trend terms left out: {', '.join(d.dropped_trend_terms[:5])}")
    if not said:
        word = "good" if d.q2 >= GOOD_Q2 else "usable"
        q2 = f"leave-one-out Q2 is {d.q2:.3f} ({word})" if np.isfinite(d.q2) else "Q2 is not defined"
        said.append(f"nothing to object to: {q2}")
    text = "; ".join(said)
    return text[0].upper() + text[1:] + "."


def _pair(pair: Pair) -> str:
    return f"{pair[0]} and {pair[1]}"


def _columns(columns: Sequence[int]) -> str:
    return ", ".join(str(k) for k in columns[:6]) + (", ..." if len(columns) > 6 else "")

"""What a screening found out about its data and itself, and whether it may be believed.

A screening is *resolved* when the selected set beats every set that misses one of its inputs by a clear
margin of likelihood, its Kriging predicts the runs left out, the other inputs together add nothing, the runs
are not too few, and the best maximum was reached from several starts. If one of these fails, the verdict is
"not resolved", with the reason and what to do: an honest answer that a selection of inputs alone cannot give.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["ScreeningDiagnosis", "fewest_runs", "judge"]

FEW_RUNS, FEW_RUNS_PER_INPUT = 10, 2.0  # with fewer, weaker inputs are missed without a sign
CLEAR_MARGIN = 2.0  # in l: the rival set is e^2 = 7 times less likely
FAIR_Q2 = 0.9  # in what is left unexplained, a tenth of the variance, further inputs may hide
SILENT_REST = 1.5  # in l: what a common theta of the inputs that were not selected may add
NOTICED = 0.02  # share of the variance from which on an unexplained part is told


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreeningDiagnosis:
    """Facts about one screening; inputs by column, runs by row, both 0-based as given.

    Attributes:
        n_runs, n_inputs: sizes.
        method, criterion, rule: in words, with sign, factor and constant.
        threshold: gain in l that an input must bring.
        base_log_likelihood: l before the first input: all theta 0, or one for all in a greedy method.
        nugget: at the selected set, relative to sigma2; `nugget_bounds` what it was allowed.
        starts, starts_at_best: ascents, and how many of them lead to the selected set.
        search_runs, evaluations: runs that the ascents saw, and likelihoods in them.
        rivals: other sets, with the fall of l - threshold * size from the selected set to them.
        margin: the smallest fall to a set that misses a selected input; inf when there is none.
        rest_gain: how far l rises when all inputs that were not selected share a theta; nan if not asked.
        q2: leave-one-out, of the Kriging with the selected inputs.
        duplicates, near_duplicates: pairs of runs.   constant, repeated: inputs; pairs of inputs.
        resolved, verdict, advice: the judgement, in words.
    """

    n_runs: int
    n_inputs: int
    method: str
    criterion: str
    rule: str
    threshold: float
    base_log_likelihood: float
    nugget: float
    nugget_bounds: tuple[float, float]
    starts: int
    starts_at_best: int
    search_runs: int
    evaluations: int
    rivals: tuple[tuple[tuple[int, ...], float], ...]
    margin: float
    rest_gain: float
    q2: float
    duplicates: tuple[tuple[int, int], ...]
    near_duplicates: tuple[tuple[int, int], ...]
    constant: tuple[int, ...]
    repeated: tuple[tuple[int, int], ...]
    resolved: bool
    verdict: str
    advice: str


def fewest_runs(n_inputs: int) -> int:
    """The runs from which on a screening of so many inputs may be called resolved: 10 and 2 per input.

    >>> fewest_runs(20)
    50
    """
    return int(np.ceil(FEW_RUNS + FEW_RUNS_PER_INPUT * n_inputs))


def judge(
    *,
    n_runs: int,
    n_inputs: int,
    n_selected: int,
    constant_response: bool,
    pool_gain: float = float("nan"),
    margin: float | None,
    rest_gain: float,
    q2: float,
    starts_at_best: int,
    repeated: Sequence[tuple[int, int]],
) -> tuple[bool, str, str]:
    """Whether the screening is resolved, the verdict in a sentence, and what to do.

    `margin` is None for a greedy method, which knows no rival sets and therefore cannot be resolved;
    `pool_gain` is what one theta for all inputs adds to l there, over a response that depends on none.

    >>> facts = {"n_runs": 50, "n_inputs": 20, "n_selected": 3, "constant_response": False, "repeated": ()}
    >>> print(judge(**facts, margin=9.0, rest_gain=0.2, q2=0.99, starts_at_best=8)[1])
    resolved: every set that misses a selected input is at least 9.0 lower in log-likelihood
    """
    if constant_response:
        return False, "nothing to screen: the response is constant", "check the response; widen the bounds"
    if n_inputs == 0:
        return (
            False,
            "nothing to screen: no input varies",
            "vary the inputs: each has the same value in all runs",
        )
    if n_selected == 0 and pool_gain >= CLEAR_MARGIN:
        return (
            False,
            f"not judged: one theta shared by all inputs raises l by {pool_gain:.1f} over noise, and no "
            "input gains by a theta of its own",
            "compare with method='default', which gives the inputs that do not act no theta",
        )
    if n_selected == 0:
        return (
            False,
            "not resolved: no input explains the response better than noise does",
            "add runs (twice as many), or average out the noise, or choose a less noisy response",
        )
    if margin is None:
        return (
            False,
            "not judged: a greedy path knows no rival sets",
            "compare with method='default', which searches for them",
        )
    reasons, cures = [], []
    if margin < CLEAR_MARGIN:
        reasons.append(f"a set without one of the selected inputs is only {max(margin, 0.0):.1f} lower in l")
        cures.append(f"add about {max(8, n_runs // 4)} runs to the design")
    if not q2 >= FAIR_Q2:
        reasons.append(
            f"left-out runs are predicted with Q2 = {q2:.2f} only; further inputs may hide in the rest"
        )
        cures.append("add runs, or look for an input that varied but is not in the table")
    if rest_gain > SILENT_REST:
        reasons.append(
            f"the inputs that were not selected still act together: l rises by {rest_gain:.1f} if they may"
        )
        cures.append(f"add about {max(8, n_runs // 2)} runs to tell which of them")
    needed = fewest_runs(n_inputs)
    if n_runs < needed:
        reasons.append(f"{n_runs} runs are few for {n_inputs} inputs: weaker ones may be missed")
        cures.append(f"come to {needed} runs")
    if starts_at_best <= 1:
        reasons.append("at most one start led to the selected set")
        cures.append("screen again with more starts")
    advice = "; ".join(dict.fromkeys(cures))
    if repeated:
        pairs = ", ".join(f"{i} and {j}" for i, j in repeated)
        known = f"inputs {pairs} cannot be told apart from these runs"
        advice = f"{advice}; {known}" if advice else known
    if reasons:
        return False, "not resolved: " + "; ".join(reasons), advice
    gap = f"at least {margin:.1f} lower" if margin < 1e300 else "much lower"
    verdict = f"resolved: every set that misses a selected input is {gap} in log-likelihood"
    if 1.0 - q2 > NOTICED:
        verdict += (
            f"; {100 * (1.0 - q2):.0f} % of the variance stays unexplained, and inputs below that may hide"
        )
    return True, verdict, advice

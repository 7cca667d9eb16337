"""The methods of a screening behind one form: nested sets of units, each with its maximum of l."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..partitions.canonical import CanonicalRuns
from ..partitions.landscape import landscape_of
from ..partitions.optimum import Optimum
from .ard import ard_screening
from .forward import forward_path
from .rival_sets import Rivals
from .rules import Rules
from .welch import welch_path

__all__ = ["METHODS", "Found", "find_sets"]

Array = NDArray[np.float64]

METHODS = ("default", "forward", "welch")
NO_RIVALS = Rivals(closest=(), margin=float("inf"), doubts=())


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What a method hands back: nested optima from the empty set on, and its search.

    Attributes:
        sets, optima, etas: nested sets of units, the maximum of l for each, the exponents (u,) there.
        accepted: which of the sets is selected.   ranked: units, most active first.
        starts, starts_at_best, search_runs, evaluations, rest_gain: see `ScreeningDiagnosis`.
        beside: rival sets.
        pool_gain: what one theta for all units adds to l, over a response that depends on none (greedy
            methods).
    """

    sets: list[tuple[int, ...]]
    optima: list[Optimum]
    accepted: int
    etas: list[Array]
    starts: int = 0
    starts_at_best: int = 0
    search_runs: int = 0
    evaluations: int = 0
    beside: Rivals = NO_RIVALS
    rest_gain: float = float("nan")
    pool_gain: float = float("nan")
    ranked: tuple[int, ...] = ()


def find_sets(runs: CanonicalRuns, method: str, rules: Rules, rng: np.random.Generator) -> Found:
    """Screen canonical runs by one of METHODS."""
    if method == "default":
        return _default(runs, rules, rng)
    nugget, threshold, eta = rules.nugget, rules.threshold, rules.eta
    if method == "forward":
        landscape = landscape_of(runs, restricted=rules.restricted, eta=eta)
        base, path = forward_path(landscape, nugget=nugget, threshold=threshold, steps=rules.size)
        etas = [np.full(len(runs.units), eta)] * (len(path) + 1)
    else:
        base, path, etas = welch_path(runs, nugget=nugget, threshold=threshold, steps=rules.size)
    sets: list[tuple[int, ...]] = [()]
    for step in path:
        sets.append((*sets[-1], step.added))
    accepted = len(path) if rules.size is not None else sum(s.gain >= threshold for s in path)
    optima = [base, *(s.optimum for s in path)]
    # a greedy path ranks by entering
    noise = _noise_likelihood(len(runs.y), restricted=rules.restricted and method == "forward")
    return Found(
        sets=sets,
        optima=optima,
        accepted=accepted,
        etas=etas,
        ranked=sets[accepted],
        pool_gain=base.value - noise,
    )


def _noise_likelihood(n: int, *, restricted: bool) -> float:
    """l of n standardised responses that depend on no input: sigma^2 R = sigma^2 I.

    >>> round(_noise_likelihood(40, restricted=False), 9)
    -20.0
    """
    m = n - 1 if restricted else n
    return float(-0.5 * (m * np.log(n / m) + (np.log(n) if restricted else 0.0) + m))


def _default(runs: CanonicalRuns, rules: Rules, rng: np.random.Generator) -> Found:
    result = ard_screening(runs, rules, rng)
    sets, optima = list(result.chain.sets[::-1]), list(result.chain.optima[::-1])
    # in the order of entering: the last to be taken out comes first
    entered: tuple[int, ...] = ()
    ordered = []
    for s in sets:
        entered = (*entered, *(u for u in s if u not in entered))
        ordered.append(entered)
    return Found(
        sets=ordered,
        optima=optima,
        accepted=len(sets) - 1 - result.chosen,
        etas=[np.full(len(runs.units), rules.eta)] * len(sets),
        starts=result.search.starts,
        starts_at_best=result.agreeing,
        search_runs=result.search_runs,
        evaluations=result.search.evaluations,
        beside=result.beside,
        rest_gain=result.rest_gain,
        ranked=result.ranked,
    )

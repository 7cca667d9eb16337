"""What a layout optimisation gives back: the design, how it got there and why it stopped."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

__all__ = ["FIRST_ORDER", "Contradiction", "HistoryEntry", "LayoutResult", "LayoutStatus", "LimitOutcome"]

Array = NDArray[np.float64]

FIRST_ORDER = 1e-3  # largest first-order error, relative to the value, of what is called converged


@dataclass(frozen=True, slots=True, kw_only=True)
class Contradiction:
    """Why no design meets the constraints: a weighted sum of them that is positive wherever one looks.

    weights: (k,) of linearised constraints, their sum is 1    constraints (k,): their numbers
    designs (k, members): where they were linearised    budgets (budgets,): weights of the budgets
    least: the smallest value of the weighted sum within the bounds, > 0
    """

    weights: Array
    constraints: NDArray[np.intp]
    designs: Array
    budgets: Array
    least: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitOutcome:
    """A limit at the returned design.

    value: the one nearest to the bound (or furthest beyond), in `unit`, and its scenario and time (nan where
    the limit is not one of a peak)    bound, upper: the limit    price: improvement of the objective per unit
    of the limit, to first order, over all its peaks and scenarios
    """

    name: str
    value: float
    bound: float
    upper: bool
    unit: str
    scenario: int
    time: float
    price: float


class LayoutStatus(Enum):
    """Why the optimisation stopped, as a sentence.

    CONVERGED is only said with a first-order error of at most `FIRST_ORDER`, INFEASIBLE only with a
    `Contradiction`.
    """

    CONVERGED = "Converged: no feasible change promises a noticeable improvement to first order."
    LIMIT = "Stopped at the limit of evaluations; more evaluations may improve the layout."
    STALLED = "Stopped because no step of any size improved the layout any further."
    IDLE_BUDGET = "The budget stays idle: the objective rewards removing members."
    ZERO_SENSITIVITY = (
        "Refused: the objective does not see these variables in this window (every sensitivity is zero)."
    )
    INFEASIBLE = "No design is feasible: the constraints contradict each other."
    NONE_FOUND = "No feasible design was found; whether there is one is not known."
    TRIVIAL = "A trivial layout was better than every iterate and is returned instead."


@dataclass(frozen=True, slots=True, kw_only=True)
class HistoryEntry:
    """One evaluation; its value is inf where the model failed.

    value, best: of this evaluation and of the best feasible design so far.    active: peaks within 1 % of it.
    budget: the largest share of a limit in use.    kkt: promised relative improvement (nan when not known).
    radius: of the trust region, or the move limit.    start: which start the run came from.
    """

    evaluation: int
    value: float
    best: float
    active: int
    budget: float
    kkt: float
    radius: float
    start: int = 0
    accepted: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutResult:
    """The best feasible design and the numbers to judge it by.

    density (members,)    value, start_value: of the objective    history: one entry per evaluation
    shadow_prices (budgets,): improvement of the value per unit of each limit, to first order
    kkt: relative improvement that the linearised problem still promises at the returned design; for a
        convex problem a bound on the distance to the optimum
    excess: largest relative violation of a budget or, in its own unit, of a further constraint
    probes: runs without gradients that looked for starts, beside the evaluations
    verdicts: plain sentences    strategy: what was done and why    optima: values of other local optima seen
    ends: best value of each search of several, that from the given start first
    limits: those of the runs, with their prices
    variables: values of law variables by name; their shares of their ranges stand behind the densities
    contradiction: the certificate of INFEASIBLE; with NONE_FOUND the density is the one that violates least
    """

    density: Array
    value: float
    start_value: float
    history: tuple[HistoryEntry, ...]
    status: LayoutStatus
    shadow_prices: Array
    kkt: float
    evaluations: int
    excess: float
    strategy: str
    verdicts: tuple[str, ...] = ()
    optima: tuple[float, ...] = ()
    baselines: dict[str, float] = field(default_factory=dict)
    iterates: tuple[Array, ...] = ()
    contradiction: Contradiction | None = None
    limits: tuple[LimitOutcome, ...] = ()
    variables: dict[str, float] = field(default_factory=dict)
    probes: int = 0
    ends: tuple[float, ...] = ()

    @property
    def grayness(self) -> float:
        """4 mean(a (1 - a)) of the density, 0 for a layout of zeros and ones."""
        a = self.density[: len(self.density) - len(self.variables)]
        return float(4 * np.mean(a * (1 - a)))

"""How many equal steps reach a tolerance: runs with n, 2 n, 4 n ... until the error is small enough.

Steps of one length keep the discrete adjoint exact and the objective smooth in the design, so the step is
chosen once, for a design, and then kept.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotConverged
from ..integration.kinds import AnySystem
from ..integration.schemes import GeneralisedAlpha, RungeKutta8, Scheme
from ..objectives.reductions import Objective
from .simulate import simulate

__all__ = ["StepChoice", "choose_steps"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class StepChoice:
    """The number of steps chosen, and how.

    steps: take these.  value: the objective with them.  relative_error: its estimated error, by
    Richardson's rule with the order seen (never above the scheme's).  order: the order seen.  tried:
    (steps, objective) of all runs."""

    steps: int
    value: float
    relative_error: float
    order: float
    tolerance: float
    tried: tuple[tuple[int, float], ...]

    @property
    def fine_enough(self) -> bool:
        """Whether the estimate is within the tolerance."""
        return self.relative_error <= self.tolerance

    @property
    def reason(self) -> str:
        """What was done, in a sentence."""
        runs = ", ".join(f"{n}: {g:.8g}" for n, g in self.tried)
        verdict = "reach" if self.fine_enough else "do not reach"
        return (
            f"{self.steps} steps {verdict} a relative error of {self.tolerance:.0e}: estimated "
            f"{self.relative_error:.1e} "
            f"at order {self.order:.1f} from runs with {runs}"
        )


def choose_steps(
    system: AnySystem,
    density: Array,
    objective: Objective,
    *,
    t_end: float,
    tolerance: float = 1e-3,
    steps: int = 50,
    most: int = 100_000,
    scheme: Scheme | None = None,
) -> StepChoice:
    """Double the steps until Richardson's estimate of the objective's relative error is within the tolerance.

        error of G_n ~ |G_n - G_2n| 2^p/(2^p - 1),   2^p = |G_n - G_2n|/|G_2n - G_4n|, 1 <= p <= order
        of the scheme

    Args:    steps: where to begin    most: no run takes more steps than this
    Returns: the coarsest n of the last three runs whose estimate is within the tolerance; at `most`, the
        best there is, with `fine_enough` False. Runs that stop (`NotConverged`) count as too coarse.
    Raises ValueError for a tolerance that is not positive, NotConverged when no run within `most` steps ends.
    """
    if not tolerance > 0.0:
        raise ValueError(f"choose_steps needs tolerance > 0, got tolerance={tolerance}")
    scheme = GeneralisedAlpha() if scheme is None else scheme
    highest = 8.0 if isinstance(scheme, RungeKutta8) else 2.0
    tried: list[tuple[int, float]] = []
    count = int(steps)
    stopped: NotConverged | None = None
    while count <= most:
        try:
            run = simulate(system, density, t_end, count, scheme=scheme)
            tried.append((count, float(objective.value(run))))
        except NotConverged as error:
            stopped = error
            tried.clear()
        if len(tried) >= 3:
            choice = _judge(tried, highest, tolerance)
            if choice.fine_enough:
                return choice
        count *= 2
    if len(tried) < 3:
        if stopped is not None:
            raise stopped
        raise ValueError(
            f"choose_steps needs room for three runs, most >= 4 steps = {4 * steps}, got most={most}"
        )
    return _judge(tried, highest, tolerance)


def _judge(tried: list[tuple[int, float]], highest: float, tolerance: float) -> StepChoice:
    """Judge the third finest run by the two finer ones; when it is too coarse, the finest as it stands."""
    (n, g1), (n2, g2), (n4, g4) = tried[-3:]
    first, second = abs(g1 - g2), abs(g2 - g4)
    rounding = 4.0 * np.finfo(float).eps * abs(g4)
    order = highest if first <= rounding else float(np.log2(first / max(second, rounding)))
    order = float(np.clip(order, 1.0, highest))
    share = 2.0**order
    scale = max(abs(g4), np.finfo(float).tiny)
    candidates = (
        (n, g1, first * share / (share - 1.0)),
        (n2, g2, second * share / (share - 1.0)),
        (n4, g4, second / (share - 1.0)),
    )
    steps, value, error = next((c for c in candidates if c[2] <= tolerance * scale), candidates[-1])
    return StepChoice(
        steps=steps, value=value, relative_error=max(error, rounding) / scale, order=order,
        tolerance=tolerance, tried=tuple(tried),
    )  # fmt: skip

"""The last steps to the worst case by the model's own gradients.

A Kriging places a smooth optimum to about a hundredth of the box; a gradient places it exactly. From the
worst runs that lie apart, L-BFGS-B (Byrd, Lu, Nocedal and Zhu 1995) climbs in the unit cube over the
continuous coordinates, with levels held and bounds kept. Every step is a true run of the search. A run that
fails, or breaks a constraint, counts as no gain and turns the line search back.
"""

import numpy as np
from scipy.optimize import minimize

from workbench.models.evaluator import Evaluator
from workbench.search.runs.ledger import Ledger

__all__ = ["ascend", "runs_kept_back"]

TOP = 5  # worst runs to climb from
APART = 0.1  # of the unit cube, largest coordinate
LEAST, PER_COORDINATE = 6, 2  # runs kept back for the ascent
ENOUGH = 1e-10  # relative gain at which a climb ends


class _Spent(Exception):
    """The runs kept back are used up."""


def runs_kept_back(ledger: Ledger, budget: int) -> int:
    """Runs of the budget to keep back: none without gradients, a third of the budget at most."""
    free = sum(grid is None for grid in ledger.where.levels)
    if not free or not ledger.slopes:
        return 0
    return min(max(PER_COORDINATE * free, LEAST), budget // 3)


def ascend(evaluate: Evaluator, ledger: Ledger, *, budget: int) -> None:
    """Climb from the worst runs until the budget is spent or no start gains any more."""
    free = [j for j, grid in enumerate(ledger.where.levels) if grid is None]
    if not free:
        return
    try:
        for start in _starts(ledger):
            _climb(evaluate, ledger, start, free, budget)
    except _Spent:
        return


def _starts(ledger: Ledger) -> list[np.ndarray]:
    """The worst runs that lie apart, worst first."""
    chosen: list[np.ndarray] = []
    for i in np.argsort(-ledger.v):
        point = ledger.u_ok[i]
        if all(np.abs(point - other).max() > APART for other in chosen):
            chosen.append(point)
        if len(chosen) == TOP:
            break
    return chosen


def _climb(evaluate: Evaluator, ledger: Ledger, start: np.ndarray, free: list[int], budget: int) -> None:
    top, scale = float(ledger.v.max()), max(float(np.ptp(ledger.v)), 1e-300)
    no_gain = 1.0, np.zeros(len(free))  # as far below as the least of the runs
    met = {_address(point): i for i, point in enumerate(ledger.u)}

    def descent(w: np.ndarray) -> tuple[float, np.ndarray]:
        """(top - v) / scale and its gradient over the free coordinates."""
        point = start.copy()
        point[free] = np.clip(w, 0.0, 1.0)
        if not ledger.where.allowed(point[None])[0]:
            return no_gain
        if _address(point) not in met:
            if ledger.spent >= budget:
                raise _Spent
            ledger.run(evaluate, point[None], purpose="gradient")
            met[_address(point)] = len(ledger.runs) - 1
        i = met[_address(point)]
        value, slope = ledger.runs[i].value, ledger.slopes.get(i)
        if value is None or slope is None:
            return no_gain
        return (top - ledger.sign * value) / scale, -slope[free] / scale

    minimize(
        descent,
        start[free],
        jac=True,
        bounds=[(0.0, 1.0)] * len(free),
        method="L-BFGS-B",
        options={"ftol": ENOUGH, "gtol": 1e-7, "maxiter": 100},
    )


def _address(point: np.ndarray) -> bytes:
    return bytes(np.round(point, 12).tobytes())

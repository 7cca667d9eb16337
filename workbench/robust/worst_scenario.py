"""The oracle of a minimax search: true runs of one design in its predicted worst scenarios.

The Kriging says where to run, the run says what it is worth. Where runs fail, the oracle closes in on the
worst that can be run: between a scenario that failed and the worst that ran it halves the predicted value.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from workbench.errors import HoldfastError
from workbench.robust.joint_prediction import JointPrediction, fit_near
from workbench.robust.joint_runs import JointRuns, Region
from workbench.robust.scenarios import doubted_scenario, safest_scenario, worst_scenario

__all__ = ["SETTLED", "Unmodelled", "challenge", "confirm", "expected_worst", "modelling"]

Array = np.ndarray

ORACLE_RUNS = 6  # true runs per cycle at one design, at most
SETTLED = 1e-4  # relative: a predicted worst this close to the worst run counts as confirmed
FAILURES_IN_A_ROW = 2  # of a design without a value, the second in its safest scenario: it is given up
CHALLENGES = 6
FAILURES_HERE = 4  # per uncertain coordinate: where so many runs of a design failed, no more are challenged
DOUBT = 2e-3  # relative: a scenario that is said to fail is challenged when it promises to be worse by that


class Unmodelled(Exception):
    """The runs could not be modelled; the message says why."""


@contextmanager
def modelling() -> Iterator[None]:
    """What goes wrong with a Kriging must not cost the runs: it ends the search, not the verb."""
    try:
        yield
    except HoldfastError:
        raise
    except (ValueError, ArithmeticError, Warning) as exc:  # warnings where they are errors
        raise Unmodelled(f"{type(exc).__name__}: {exc}") from exc


def confirm(runs: JointRuns, model: JointPrediction, x: Array, region: Region, number: int) -> float:
    """Run x in its predicted worst scenarios until none worse is predicted; its worst run, inf without.

    A scenario that failed, or is likely to, is not proposed; where all are, the safest is run instead.
    """
    failures, below, ceiling = 0, np.inf, np.inf
    for attempt in range(ORACLE_RUNS):
        replicate = 7919 * number + attempt
        with modelling():
            u, predicted = worst_scenario(runs, model, x, replicate, below=below)
        worst, _ = runs.worst_run(x)
        without = worst == -np.inf
        if runs.left < 1 or (without and failures >= FAILURES_IN_A_ROW):
            break
        if without and (failures or predicted == -np.inf):
            u = safest_scenario(runs, model, x, replicate)
        elif predicted <= worst + SETTLED * (1 + abs(worst)):
            break
        known = runs.near(x, u)
        if np.isfinite(runs.y[known]).any():
            break
        y = np.nan if known.any() else float(runs.run(np.concatenate([x, u])[None], "minimax oracle")[0])
        if np.isfinite(y):
            runs.scenarios.append(u)
            failures, below = 0, 0.5 * (y + ceiling)
            with modelling():
                model = fit_near(runs, region)
        else:
            failures += 1
            if not without and failures >= FAILURES_IN_A_ROW:
                ceiling = predicted
                below = 0.5 * (worst + ceiling)
            with modelling():
                model = model.after_failure()
    worst, _ = runs.worst_run(x)
    return worst if np.isfinite(worst) else np.inf


def challenge(runs: JointRuns, model: JointPrediction, region: Region, number: int) -> None:
    """Run the design at the centre of the region in worse scenarios that only runs at other designs say fail,
    until one gives a value."""
    x = region.centre
    for attempt in range(CHALLENGES if runs.has_failures else 0):
        if runs.left < 1 or (runs.at_design(x) & np.isnan(runs.y)).sum() >= FAILURES_HERE * runs.du:
            break
        worst, _ = runs.worst_run(x)
        with modelling():
            model = model.after_failure() if attempt else fit_near(runs, region)
            u, predicted = doubted_scenario(runs, model, x, 7919 * number + attempt)
        if predicted <= worst + DOUBT * max(abs(worst), 1e-2 * runs.spread) or runs.near(x, u).any():
            break
        y = runs.run(np.concatenate([x, u])[None], "minimax oracle")
        if np.isfinite(y[0]):
            runs.scenarios.append(u)
            break


def expected_worst(runs: JointRuns, region: Region, number: int) -> float:
    """The worst run of the design at the centre of the region, or the worst that is predicted and likely to
    run there if that is more."""
    x = region.centre
    with modelling():
        _, predicted = worst_scenario(runs, fit_near(runs, region), x, 7919 * number)
    return max(runs.worst_run(x)[0], predicted)

"""The min-max master: searches over peaks and scenarios, by a trust region, from several starts.

Several local optima are the rule on long windows: which peaks are traded is decided early. Starts that
differ in what the *response* sees are corners of the feasible set (`corners.py`), evaluated once and pursued
in the order of their values, each as long as it earns its evaluations. Where the caller allows runs without
gradients, layouts of shorter windows are taken on to longer ones first (`growing_windows.py`), these runs
look for starts (`probing.py`) and correct the steps (`trust_region.py`); all are pursued in turns, and the
corners get what is left.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import local_peaks
from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import FEASIBLE, Recorder
from .corners import corner_starts
from .growing_windows import CHAINS, Chain, InTime, grown_start
from .probing import probed_starts
from .trust_region import CORRECTIONS, RADIUS, TrustRegionRun

__all__ = ["min_max", "race", "some_steps"]

Array = NDArray[np.float64]

_REPAIRS = 3  # last evaluations, kept to bring the best design inside its limits
_NEARLY = 1e-2  # promise, relative to the value, of a search on its last steps
_SEED = 0  # of the searches without gradients: the same problem has the same layout every time
_BLOCK = 5  # steps of one search before the others are looked at again
_CHAINS = 2  # of those there are, before searches without gradients; others where evaluations are left
_SHARE = 4  # of these runs per evaluation, which searches without gradients leave to the steps
_TRIAL = 8  # steps that a start may take before it must have earned more
_ALIKE = 0.01  # of the value, at every node: two searches in one valley


def min_max(
    problem: LayoutProblem,
    recorder: Recorder,
    *,
    max_evaluations: int,
    tolerance: float,
    multi_start: bool,
    probes: int = 0,
) -> TrustRegionRun:
    """Search from the start, then, if asked to, from probed starts and corners; the best run comes back.

    probes: runs without gradients that may look for starts (`probing.py`) and correct steps.
    """
    start = problem.into_budgets(problem.start)

    def new_run(density: Array, index: int, evaluation: Evaluation) -> TrustRegionRun:
        recorder.start_index = index
        recorder.add(density, evaluation, radius=RADIUS)
        return TrustRegionRun(
            problem=problem, recorder=recorder, density=density, evaluation=evaluation,
            tolerance=tolerance, index=index, most_probes=probes,
        )  # fmt: skip

    first = new_run(start, 0, problem.checked(start))
    corners = corner_starts(problem, first.evaluation) if multi_start else []

    def pursue(run: TrustRegionRun, steps: int) -> None:
        for _ in range(steps):
            if run.finished or recorder.evaluations >= max_evaluations:
                return
            run.step()

    # two evaluations per corner at least, or the corners are not worth starting
    share = max_evaluations - 2 * len(corners)
    pursue(first, max_evaluations if not corners else max(_TRIAL + 2, 0 if probes else share // 4))
    if first.limited and first.promise <= _NEARLY * abs(first.value):
        pursue(first, max_evaluations)  # on its last steps, which converge fast
    runs = [first]
    several = bool(corners) and not (first.finished and _smooth(first))
    if several and probes:

        def join(density: Array | None) -> None:
            if density is None or recorder.evaluations >= max_evaluations:
                return
            evaluation = problem.tried(density)
            if evaluation is not None:
                runs.append(new_run(density, len(corners) + len(runs), evaluation))

        def grow(chain: Chain) -> None:
            enough = recorder.evaluations + chain.cost + _TRIAL <= max_evaluations
            if enough and isinstance(problem.evaluate, InTime):
                search = partial(some_steps, tolerance=tolerance)
                join(grown_start(problem, recorder, chain, search, max_evaluations=max_evaluations))

        recorder.start_index = len(corners) + 1
        for chain in CHAINS[:_CHAINS]:
            grow(chain)
        recorder.start_index = len(corners) + 1
        found = probed_starts(
            problem, recorder, probes=probes - _SHARE * max_evaluations, max_evaluations=max_evaluations,
            most=(max_evaluations - recorder.evaluations) // (2 * _BLOCK), rng=np.random.default_rng(_SEED),
        )  # fmt: skip
        for _, density in found:
            join(density)
        race(runs, recorder, max_evaluations=max_evaluations)
        for chain in CHAINS[_CHAINS:]:
            before = len(runs)
            grow(chain)
            if len(runs) > before:
                race(runs, recorder, max_evaluations=max_evaluations)
    if several and recorder.evaluations + 2 * len(corners) <= max_evaluations:
        waiting = []
        for index, corner in enumerate(corners, start=1):
            if recorder.evaluations >= max_evaluations:
                break
            evaluation = problem.tried(corner)
            if evaluation is None:
                recorder.start_index = index
                recorder.fail(corner)
            else:
                waiting.append(new_run(corner, index, evaluation))
        for run in sorted(waiting, key=lambda r: r.value):
            pursue(run, _TRIAL // 2)
            best = min(r.value for r in runs)
            if run.value < 1.5 * best if best > 0 else run.value < best + 0.5 * abs(best):
                pursue(run, _TRIAL // 2)
            runs.append(run)
    spare = _REPAIRS if first.limited and max_evaluations > 4 * _REPAIRS else 0
    for run in sorted(runs, key=lambda r: r.value):
        pursue(run, max(0, max_evaluations - spare - recorder.evaluations))
    for run in sorted(runs, key=lambda r: r.value)[: 1 if first.limited else 0]:
        made = -1
        while (
            made < recorder.evaluations < max_evaluations  # a step without promise makes no evaluation
            and run.penalty.violation(run.evaluation) > FEASIBLE
        ):
            made = recorder.evaluations
            run.come_inside()
    recorder.optima += [run.value for run in runs if run.finished]
    recorder.ends = [run.value for run in runs] if len(runs) > 1 and not first.limited else []
    return min(runs, key=lambda r: r.value)


def race(runs: list[TrustRegionRun], recorder: Recorder, *, max_evaluations: int) -> None:
    """Pursue several searches, the next block of steps going to the one that may be the best after it.

    What may come of a search is its value less what its last block gained. One that has had no block of its
    own comes first: the values of starts say little of where they lead. One whose history has become that
    of a better search is in its valley, and is left.
    """
    hoped = {run.index: -np.inf for run in runs}
    left: set[int] = set()
    while recorder.evaluations < max_evaluations:
        going = [run for run in runs if not run.finished and run.index not in left]
        if not going:
            return
        run = min(going, key=lambda run: hoped[run.index])
        if any(_in_the_valley_of(run, other) for other in runs if other.index not in left):
            left.add(run.index)
            continue
        before = run.value
        for _ in range(_BLOCK):
            if run.finished or recorder.evaluations >= max_evaluations:
                break
            run.step()
        hoped[run.index] = 2 * run.value - before


def _in_the_valley_of(run: TrustRegionRun, other: TrustRegionRun) -> bool:
    """True when both have nearly one history and the other is the better one."""
    if run is other or run.value < other.value:
        return False
    apart = np.abs(np.atleast_2d(run.evaluation.values) - np.atleast_2d(other.evaluation.values))
    return float(apart.max()) <= _ALIKE * abs(other.value)


def some_steps(
    problem: LayoutProblem, density: Array, *, evaluations: int, recorder: Recorder, tolerance: float
) -> Array:
    """Where a search stands after so many evaluations."""
    evaluation = problem.tried(density)
    if evaluation is None:
        recorder.fail(density)
        return density
    recorder.add(density, evaluation)
    run = TrustRegionRun(
        problem=problem, recorder=recorder, density=density, evaluation=evaluation, tolerance=tolerance,
        most_probes=CORRECTIONS * evaluations, finished=not np.ptp(np.atleast_2d(evaluation.values)) > 0,
    )  # fmt: skip
    while not run.finished and recorder.evaluations < evaluations:
        run.step()
    return run.density


def _smooth(run: TrustRegionRun) -> bool:
    """True when one peak alone decides at the optimum: no peak was traded, other starts promise little."""
    values = np.atleast_2d(run.evaluation.values)
    top = float(values.max())
    return len(local_peaks(values, above=top - 1e-3 * abs(top))) == 1

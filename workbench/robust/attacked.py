"""The attack on what a minimax search found: is a scenario worse than the worst that it knows at its design?

The adversary of `workbench.search.evidence.attack` looks over the uncertainty with the design held. What it
finds becomes a scenario; the other designs that were tried are run in it, the search goes on with some of the
attack's runs, and the best design of all is attacked in its turn. So the returned design is the best of those
tried over all scenarios that anybody found, and bounds that met are called converged only where an attack has
left them standing.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.models.evaluator import Outcome
from workbench.robust.cycles import CuttingSets
from workbench.robust.minimax_record import Minimax, MinimaxStatus
from workbench.robust.worst_scenario import Unmodelled
from workbench.search.evidence.attack.adversary import attack
from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.grade import Grade, fewest_runs

__all__ = ["attacked"]

Array = np.ndarray

ROUNDS = 3
RIVALS = 8  # tried designs, and as many others, that are run in a scenario that broke the best one
GO_ON = 5  # runs per coordinate with which the search goes on
BROKEN = 5e-3  # of the value, or of 1 % of the spread of the values when that is more


def attacked(game: CuttingSets, found: Minimax, *, budget: int | None, tolerance: float) -> Minimax:
    """Attack the design of a finished search with `budget` true runs beside its own.

    Without a budget the attack gets what a search that ended by itself has left, and none where that is too
    little for a claim.
    """
    runs = game.runs
    least = fewest_runs(runs.du)
    settled = found.status in (MinimaxStatus.CONVERGED, MinimaxStatus.SETTLED)
    left = max(runs.budget - len(runs.y), 0) if settled else 0
    total = (left if left >= least else 0) if budget is None else budget
    if found.status is MinimaxStatus.EXHAUSTED or not total:
        return replace(found, status=_unattacked(found.status))
    _, x, _ = _place(game, found)
    each = max(total // ROUNDS, min(total, least))
    spent, number, n_given = 0, 0, len(runs.scenarios)
    while True:
        value, worst = runs.worst_run(x)
        attacked_x = x
        made = _attack(game, x, worst, value=value, budget=min(each, total - spent), seed=runs.seed + number)
        spent, number = spent + made.runs, number + 1
        is_broken = made.excess > BROKEN * max(abs(value), 1e-2 * runs.spread)
        if made.is_beaten:
            _take_up(game, x, made)
        spare = total - spent - least
        if not is_broken or spare < 0:
            break
        spent += _go_on(game, runs=min(spare, GO_ON * runs.dimension), tolerance=tolerance)
        x = _lowest(game, given=n_given)
    if is_broken:
        x = _lowest(game, given=n_given)
    value, scenario = runs.worst_run(x)
    judged = replace(
        found,
        design=runs.design.rows(runs.worst_design(x)[None])[0],
        scenario=runs.uncertain.rows(scenario[None])[0],
        value=value,
        lower=min(found.lower, value),
        status=MinimaxStatus.BEATEN if is_broken else found.status,
        scenarios=tuple(runs.uncertain.rows(np.array(runs.scenarios))) if runs.scenarios else (),
        evaluations=runs.made,
        budget=found.budget + (budget or 0),
        failed=tuple(runs.failed),
        failure_map=runs.failure_map,
        # of another design it says nothing
        attack=made.raised_to(value) if np.array_equal(x, attacked_x) else None,
    )
    return replace(judged, status=_unattacked(judged.status)) if judged.grade is Grade.SEARCHED else judged


def _go_on(game: CuttingSets, *, runs: int, tolerance: float) -> int:
    """Let the search go on with the scenarios that the attack has added; the runs that it made."""
    before = len(game.runs.y)
    if runs:
        game.runs.budget = before + runs
        with suppress(Unmodelled):
            game.search(tolerance=tolerance, progress=None)
    return len(game.runs.y) - before


def _lowest(game: CuttingSets, *, given: int) -> Array:
    """The tried design of the lowest worst run once it was run in every scenario from number `given` on: a
    search that goes on may return to a neighbour of a broken design."""
    runs = game.runs
    while True:
        _, x, _ = game.lowest()
        points = np.array([np.concatenate([x, u]) for u in runs.scenarios[given:]])
        runs.budget = max(runs.budget, len(runs.y) + len(points))
        before = len(runs.y)
        runs.run(points, "minimax attack")
        if len(runs.y) == before:
            return x


def _unattacked(status: MinimaxStatus) -> MinimaxStatus:
    return MinimaxStatus.MET if status is MinimaxStatus.CONVERGED else status


def _place(game: CuttingSets, found: Minimax) -> tuple[float, Array, Array]:
    """The returned design as a point, with its worst run."""
    x = game.runs.design.unit([dict(found.design)])[0]
    value, u = game.runs.worst_run(x)
    return value, x, u


def _attack(game: CuttingSets, x: Array, u: Array, *, value: float, budget: int, seed: int) -> Attack:
    runs = game.runs
    design = runs.design.rows(runs.worst_design(x)[None])[0]

    def held(rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        outcomes = runs.outcomes([{**design, **row} for row in rows], purpose=f"minimax {purpose}")
        return [replace(o, parameters=dict(row)) for o, row in zip(outcomes, rows, strict=True)]

    return attack(
        held,
        runs.uncertain.space,
        value=value,
        budget=budget,
        seed=seed,
        response=runs.read,
        claimed=runs.uncertain.rows(u[None])[0],
    )


def _take_up(game: CuttingSets, x: Array, made: Attack) -> None:
    """Make the worst case of an attack a scenario of the search, and run the best other designs in it."""
    runs = game.runs
    assert made.parameters is not None  # it beat the claim
    u = runs.uncertain.unit([dict(made.parameters)])[0]
    worst = runs.worst_design(x)
    ran = np.unique(runs.z[np.isfinite(runs.y), : runs.dx], axis=0)
    others = [t for t in ran if not any(np.array_equal(t, known) for known in game.tried)]
    for designs in (game.tried, others):
        designs.sort(key=lambda t: runs.worst_run(t)[0])
    # the best of the others may all be neighbours of the broken design
    spread = others[:: -(-len(others) // RIVALS)] if others else []
    rivals = [t for t in (*game.tried[:RIVALS], *spread) if not np.array_equal(t, x)]
    chosen = [worst, *rivals]
    runs.budget = max(runs.budget, len(runs.y) + len(chosen))
    runs.run(np.array([np.concatenate([t, u]) for t in chosen]), "minimax attack")
    runs.scenarios.append(u)
    game.tried += spread

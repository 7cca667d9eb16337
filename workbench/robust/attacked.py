"""The attack on what a minimax search found: is a scenario worse than the worst that it knows at its design?

The adversary of `workbench.search.evidence.attack` looks over the uncertainty with the design held. What it
finds becomes a scenario; the other designs that were tried are run in it, the search goes on with some of the
attack's runs, and the best design of all is attacked in its turn. So the returned design is the best of those
tried over all scenarios that anybody found, and bounds that met are called converged only where an attack has
left them standing.

A design that is best against several scenarios is nearly as bad in each of them, and each moves with the
design, so that the worst of its neighbours lies on the flank of its own. An attack therefore begins with
short climbs from every bad scenario that is known of the design, and one that has broken nothing goes on with
all runs that are left, from the tops among the cases that it met.
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
PLACES, APART = 4, 0.2  # bad scenarios that local climbs begin at, and their distance in a unit coordinate
EXPECTATIONS = 1000  # streams of random numbers apart from those of the cycles
BROKEN = 5e-3  # of the value, or of 1 % of the spread of the values when that is more


def attacked(game: CuttingSets, found: Minimax, *, budget: int | None, tolerance: float) -> Minimax:
    """Attack the design of a finished search with `budget` true runs beside its own.

    A third of them at first: a design that breaks is repaired, and what replaces it is attacked anew. One
    that does not is attacked with all the others. Without a budget the attack gets what a search that ended
    by itself has left, and none where that is too little for a claim.
    """
    runs = game.runs
    least = fewest_runs(runs.du)
    settled = found.status in (MinimaxStatus.CONVERGED, MinimaxStatus.SETTLED)
    left = max(runs.budget - len(runs.y), 0) if settled else 0
    total = (left if left >= least else 0) if budget is None else budget
    if found.status is MinimaxStatus.EXHAUSTED or not total:
        return replace(found, status=_unattacked(found.status))
    _, x, _ = _place(game, found)
    x, record, is_broken = _fought(game, x, total=total, least=least, tolerance=tolerance)
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
        attack=None if record is None else record.raised_to(value),
    )
    return replace(judged, status=_unattacked(judged.status)) if judged.grade is Grade.SEARCHED else judged


def _fought(
    game: CuttingSets, x: Array, *, total: int, least: int, tolerance: float
) -> tuple[Array, Attack | None, bool]:
    """The best design after attacks of `total` runs, the attacks on it since it was last broken, None where
    there was none, and whether the last of all attacks broke a design."""
    runs = game.runs
    each = max(total // ROUNDS, min(total, least))
    spent, number, n_given = 0, 0, len(runs.scenarios)
    record: Attack | None = None
    climbed: list[Array] = []  # scenarios of the present design that local climbs began at
    while True:
        value, _ = runs.worst_run(x)
        left = total - spent
        budget = min(each, left) if record is None else left
        enough = value + BROKEN * max(abs(value), 1e-2 * runs.spread)
        made = _attack(game, x, budget=budget, enough=enough, record=record, climbed=climbed, number=number)
        spent, number = spent + made.runs, number + 1
        is_broken = made.largest is not None and made.largest > enough
        if made.is_beaten:
            _take_up(game, x, made, with_rivals=is_broken)
        record = (made if record is None else record.and_then(made)).raised_to(runs.worst_run(x)[0])
        spare = total - spent - least
        if spare < 0 or (made.is_exhaustive and not is_broken):
            break
        if is_broken:
            spent += _go_on(game, runs=min(spare, GO_ON * runs.dimension), tolerance=tolerance)
            x, record, climbed = _lowest(game, given=n_given), None, []
    if not is_broken:
        return x, record, False
    best = _expected(game, given=n_given, number=number)
    return best, record if np.array_equal(best, x) else None, True  # of another design it says nothing


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


def _expected(game: CuttingSets, *, given: int, number: int) -> Array:
    """The design of the lowest expected worst once no run is left to look at it: the lowest worst run may be
    that of a design that was hardly run."""
    lowest = _lowest(game, given=given)
    with suppress(Unmodelled):
        return game.best_expected(len(game.cycles) + EXPECTATIONS + number)[1]
    return lowest


def _unattacked(status: MinimaxStatus) -> MinimaxStatus:
    return MinimaxStatus.MET if status is MinimaxStatus.CONVERGED else status


def _place(game: CuttingSets, found: Minimax) -> tuple[float, Array, Array]:
    """The returned design as a point, with its worst run."""
    x = game.runs.design.unit([dict(found.design)])[0]
    value, u = game.runs.worst_run(x)
    return value, x, u


def _attack(
    game: CuttingSets,
    x: Array,
    *,
    budget: int,
    enough: float,
    record: Attack | None,
    climbed: list[Array],
    number: int,
) -> Attack:
    """An attack on a design, until it is broken; after the ones of `record` it goes on, with climbs from
    where none has begun."""
    runs = game.runs
    design = runs.design.rows(runs.worst_design(x)[None])[0]
    value, u = runs.worst_run(x)
    bad = _bad_places(game, x, record, climbed)
    climbed += [place for place, _ in bad]

    def held(rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        outcomes = runs.outcomes([{**design, **row} for row in rows], purpose=f"minimax {purpose}")
        return [replace(o, parameters=dict(row)) for o, row in zip(outcomes, rows, strict=True)]

    return attack(
        held,
        runs.uncertain.space,
        value=value,
        budget=budget,
        seed=runs.seed + number,
        response=runs.read,
        claimed=runs.uncertain.rows(u[None])[0],
        known=[(runs.uncertain.rows(place[None])[0], at) for place, at in bad],
        goes_on=record is not None,
        enough=enough,
    )


def _bad_places(
    game: CuttingSets, x: Array, record: Attack | None, climbed: list[Array]
) -> list[tuple[Array, float]]:
    """The worst scenarios (du,) that a design was run in, with their values, apart from `climbed` and each
    other.

    A design that is best against several scenarios is nearly as bad in each of them, and each moves with the
    design: the worst of a neighbour lies on the flank of this one's.
    """
    runs = game.runs
    here = runs.at_design(x) & np.isfinite(runs.y)
    made = [(a.point, a.value) for a in (record.attempts if record else ()) if a.value is not None]
    places = np.vstack([runs.z[here, runs.dx :], *(point[None] for point, _ in made)])
    values = np.concatenate([runs.y[here], [value for _, value in made]])
    bad: list[tuple[Array, float]] = []
    for i in np.argsort(-values, kind="stable"):
        others = (*climbed, *(place for place, _ in bad))
        is_apart = all(np.abs(places[i] - other).max() > APART for other in others)
        if is_apart and (not others or _is_top(i, places, values)):
            bad.append((places[i], float(values[i])))
        if len(bad) == PLACES:
            break
    return bad


def _is_top(i: int, places: Array, values: Array) -> bool:
    """Whether none of the runs next to run i, one more than there are coordinates, is worse: the others stand
    on the flanks of peaks that are climbed already."""
    away = np.abs(places - places[i]).max(axis=1)
    beside = np.argsort(away, kind="stable")[: places.shape[1] + 2]
    return bool(values[beside].max() <= values[i])


def _take_up(game: CuttingSets, x: Array, made: Attack, *, with_rivals: bool) -> None:
    """Make the worst case of an attack a scenario of the search, and run the best other designs in it where
    it broke the attacked one."""
    runs = game.runs
    assert made.parameters is not None  # it beat the claim
    u = runs.uncertain.unit([dict(made.parameters)])[0]
    worst = runs.worst_design(x)
    if not with_rivals:
        runs.budget = max(runs.budget, len(runs.y) + 1)
        runs.run(np.concatenate([worst, u])[None], "minimax attack")
        runs.scenarios.append(u)
        return
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

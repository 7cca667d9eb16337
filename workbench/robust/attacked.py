"""The attack on what a minimax search found: is a scenario worse than the worst that it knows at its design?

The adversary of `workbench.search.evidence.attack` looks over the uncertainty with the design held. What it
finds becomes a scenario; the design is repaired with half of the runs that are left
(`workbench.robust.repair`), and the best design of all is attacked in its turn with the others. So the
returned design is the best of those tried over all scenarios that anybody found, as far as the runs reach,
and bounds that met are called converged only where an attack has left them standing.

A design that is best against several scenarios is nearly as bad in each of them, and each moves with the
design, so that the worst of its neighbours lies on the flank of its own. An attack therefore begins with
short climbs from every bad scenario that is known of the design, and one that has broken nothing goes on with
all runs that are left, from the tops among the cases that it met.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.models.evaluator import Outcome
from workbench.robust.cycles import CuttingSets
from workbench.robust.minimax_record import Minimax, MinimaxStatus
from workbench.robust.repair import chosen_unattacked, repaired, take_up
from workbench.search.evidence.attack.adversary import attack
from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.attack.tops import is_top
from workbench.search.evidence.grade import Grade, fewest_runs

__all__ = ["attacked"]

Array = np.ndarray

ROUNDS = 3
PLACES, APART = 4, 0.2  # bad scenarios that local climbs begin at, and their distance in a unit coordinate
SHORTEST = 10  # runs with which an attack that broke nothing still goes on
BROKEN = 5e-3  # of the value, or of 1 % of the spread of the values when that is more


def attacked(game: CuttingSets, found: Minimax, *, budget: int | None, tolerance: float) -> Minimax:
    """Attack the design of a finished search with `budget` true runs beside its own.

    A third of them at first: a design that breaks is repaired, and what replaces it is attacked anew. One
    that does not is attacked with all the others. Repairs are paid from the same runs, and from what the
    search has left: the runs of search and attack together are never exceeded. Without a budget the attack
    gets what a search that ended by itself has left, and none where that is too little for a claim.
    """
    runs = game.runs
    least = fewest_runs(runs.du)
    settled = found.status in (MinimaxStatus.CONVERGED, MinimaxStatus.SETTLED)
    left = max(runs.budget - len(runs.y), 0) if settled else 0
    total = (left if left >= least else 0) if budget is None else budget
    if found.status is MinimaxStatus.EXHAUSTED or not total:
        return replace(found, status=_unattacked(found.status))
    limit = found.budget + (budget or 0)
    _, x, _ = _place(game, found)
    x, record, is_beaten = _fought(game, x, total=total, limit=limit, least=least, tolerance=tolerance)
    value, scenario = runs.worst_run(x)
    judged = replace(
        found,
        design=runs.design.rows(runs.worst_design(x)[None])[0],
        scenario=runs.uncertain.rows(scenario[None])[0],
        value=value,
        lower=min(found.lower, value),
        predicted=min(found.predicted, value),
        scenarios=tuple(runs.uncertain.rows(np.array(runs.scenarios))) if runs.scenarios else (),
        evaluations=runs.made,
        budget=limit,
        failed=tuple(runs.failed),
        failure_map=runs.failure_map,
        attack=None if record is None else record.raised_to(value),
    )
    if is_beaten:
        return replace(judged, status=MinimaxStatus.BEATEN)
    if judged.status is MinimaxStatus.CONVERGED and value - judged.predicted > runs.threshold(
        value, tolerance
    ):
        return replace(judged, status=MinimaxStatus.OPENED)
    return replace(judged, status=_unattacked(judged.status)) if judged.grade is Grade.SEARCHED else judged


def _fought(
    game: CuttingSets, x: Array, *, total: int, limit: int, least: int, tolerance: float
) -> tuple[Array, Attack | None, bool]:
    """The best design after attacks of `total` runs, the attacks on it since it was last broken, None where
    there was none, and whether an attack broke a design and none that counts has left standing what replaced
    it. With repairs no more than `limit` runs are made in all."""
    runs = game.runs
    each = max(total // ROUNDS, min(total, least))
    spent, number, n_given = 0, 0, len(runs.scenarios)
    record: Attack | None = None
    is_repaired = False
    climbed: list[Array] = []  # scenarios of the present design that local climbs began at
    while True:
        value, _ = runs.worst_run(x)
        left = min(total - spent, limit - runs.made)
        budget = min(each, left) if record is None else left
        enough = value + BROKEN * max(abs(value), 1e-2 * runs.spread)
        made = _attack(game, x, budget=budget, enough=enough, record=record, climbed=climbed, number=number)
        spent, number = spent + made.runs, number + 1
        is_broken = made.largest is not None and made.largest > enough
        if made.is_beaten:
            u = take_up(game, x, made)
        record = (made if record is None else record.and_then(made)).raised_to(runs.worst_run(x)[0])
        left = min(total - spent, limit - runs.made)
        if left < SHORTEST or (made.is_exhaustive and not is_broken):
            break
        if is_broken:
            allowed = left // 2  # the other half is for an attack on what replaces the design
            x = repaired(game, x, u, given=n_given, allowed=allowed, tolerance=tolerance, number=number)
            record, climbed, is_repaired = None, [], True
    if not is_broken:
        is_long = record.runs >= least or record.is_exhaustive
        return x, record, is_repaired and not is_long
    best = chosen_unattacked(game, given=n_given, allowed=limit - runs.made, number=number)
    return best, record if np.array_equal(best, x) else None, True  # of another design it says nothing


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
        if is_apart and (not others or is_top(int(i), places, values)):
            bad.append((places[i], float(values[i])))
        if len(bad) == PLACES:
            break
    return bad

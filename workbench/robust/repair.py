"""What follows where an attack has broken the design of a minimax search: which of those tried is best now?

The worst case of the attack becomes a scenario. The best other designs are run in it, the search goes on with
it, and the scenarios that attacks have added are run at whichever design is lowest, the most threatening one
first, until it is lowest with all of them run. A design that one scenario has raised above another is run in
no more: which design is lowest at the end is the same, for a fraction of the runs.

Each step makes at most the runs that it is allowed. Where they end before all is run, the lowest worst run
may be that of a design that was hardly run, and the one of the lowest expected worst is taken.
"""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from workbench.robust.cycles import CuttingSets
from workbench.robust.joint_runs import SAME, JointRuns
from workbench.robust.worst_scenario import Unmodelled
from workbench.search.evidence.attack.record import Attack

__all__ = ["chosen_unattacked", "repaired", "take_up"]

Array = np.ndarray

RIVALS = 8  # tried designs, and as many others, that are run in a scenario that broke the best one
GO_ON = 5  # runs per coordinate with which the search goes on
EXPECTATIONS = 1000  # streams of random numbers apart from those of the cycles


def take_up(game: CuttingSets, x: Array, made: Attack) -> Array:
    """Make the worst case of an attack on design x a run and a scenario (du,) of the search."""
    runs = game.runs
    assert made.parameters is not None  # it beat the claim
    u: Array = runs.uncertain.unit([dict(made.parameters)])[0]
    runs.keep(np.concatenate([runs.worst_design(x), u]), made.parameters)
    runs.scenarios.append(u)
    return u


def repaired(
    game: CuttingSets, x: Array, u: Array, *, given: int, allowed: int, tolerance: float, number: int
) -> Array:
    """The design to attack next, after x was broken in the scenario u, with at most `allowed` true runs.

    A third of them for rivals in u and a third for the search, where they need as many; the scenarios from
    number `given` on are run at what is lowest with the rest.
    """
    runs, end = game.runs, game.runs.made + allowed
    _run_rivals(game, x, u, allowed=allowed // 3)
    _go_on(game, allowed=min(allowed // 3, GO_ON * runs.dimension), tolerance=tolerance)
    lowest, is_settled = _lowest_in_all(game, given=given, allowed=end - runs.made)
    return lowest if is_settled else _expected_lowest(game, number=number)


def _run_rivals(game: CuttingSets, x: Array, u: Array, *, allowed: int) -> None:
    """Run the best other designs in the scenario that broke x, by turns of those tried and of all others."""
    runs = game.runs
    ran = np.unique(runs.z[np.isfinite(runs.y), : runs.dx], axis=0)
    others = [t for t in ran if not any(np.array_equal(t, known) for known in game.tried)]
    for designs in (game.tried, others):
        designs.sort(key=lambda t: runs.worst_run(t)[0])
    # the best of the others may all be neighbours of the broken design
    spread = others[:: -(-len(others) // RIVALS)] if others else []
    tried = [t for t in game.tried[:RIVALS] if not np.array_equal(t, x)]
    n_spread = min(len(spread), max(allowed // 2, allowed - len(tried)))
    rivals = [*tried[: allowed - n_spread], *spread[:n_spread]]
    if rivals:
        runs.allow(allowed)
        runs.run(np.array([np.concatenate([t, u]) for t in rivals]), "minimax attack")
    game.tried += spread[:n_spread]


def _go_on(game: CuttingSets, *, allowed: int, tolerance: float) -> None:
    """Let the search go on with the scenarios that the attack has added."""
    game.runs.allow(allowed)
    if allowed:
        with suppress(Unmodelled):
            game.search(tolerance=tolerance, progress=None)


def _lowest_in_all(game: CuttingSets, *, given: int, allowed: int) -> tuple[Array, bool]:
    """The tried design of the lowest worst run, and whether it was run in every scenario from number `given`
    on: a search that goes on may return to a neighbour of a broken design."""
    runs = game.runs
    runs.allow(allowed)
    while True:
        _, x, _ = game.lowest()
        open_ = [u for u in runs.scenarios[given:] if not runs.is_known(x, u)]
        if not open_ or runs.left < 1:
            return x, not open_
        runs.run(np.concatenate([x, _most_threatening(runs, x, open_)])[None], "minimax attack")


def _most_threatening(runs: JointRuns, x: Array, scenarios: Sequence[Array]) -> Array:
    """The scenario (du,) that is worst at the design next to x among those that were run in it."""
    away = np.abs(runs.z[:, : runs.dx] - x).max(axis=1)

    def threat(u: Array) -> float:
        here = np.isfinite(runs.y) & np.all(np.abs(runs.z[:, runs.dx :] - u) < SAME, axis=1)
        return float(runs.y[here][np.argmin(away[here])]) if here.any() else -np.inf

    return max(scenarios, key=threat)


def chosen_unattacked(game: CuttingSets, *, given: int, allowed: int, number: int) -> Array:
    """The design to return where too few runs are left to attack another: what is lowest is run in the
    scenarios known and in those that the Kriging predicts, and the lowest expected worst is taken, since the
    lowest worst run may be that of a design that was hardly run."""
    end = game.runs.made + allowed
    _lowest_in_all(game, given=given, allowed=allowed)
    game.runs.allow(end - game.runs.made)
    with suppress(Unmodelled):
        game.best_confirmed(len(game.cycles) + EXPECTATIONS + number)
    return _expected_lowest(game, number=number)


def _expected_lowest(game: CuttingSets, *, number: int) -> Array:
    """The design of the lowest expected worst, or of the lowest worst run where no Kriging says."""
    with suppress(Unmodelled):
        return game.best_expected(len(game.cycles) + EXPECTATIONS + number)[1]
    return game.lowest()[1]

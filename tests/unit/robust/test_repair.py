"""What replaces a design that an attack has broken, and what it costs."""

import numpy as np
import pytest

from workbench import Parameter, Space, minimax
from workbench.models.evaluator import FunctionEvaluator, response_reader
from workbench.robust import repair
from workbench.robust.cycles import CuttingSets
from workbench.robust.joint_runs import JointRuns
from workbench.robust.minimax_record import MinimaxStatus
from workbench.search.evidence.grade import Grade
from workbench.search.runs.unit_space import SearchSpace

CHOICE = Space([Parameter("a", lower=0, upper=1)])
DANGER = Space([Parameter("v", lower=0, upper=1)])
BUDGET, ATTACK = 30, 100
TOLERANCE = 1e-2


def _two_peaks(a, v):
    """A narrow and a broad peak that move with the design and grow in opposite directions."""
    narrow = (1 + 0.6 * a) * np.exp(-(((v - 0.25 - 0.3 * a) / 0.06) ** 2) / 2)
    broad = (1.5 - 0.5 * a) * np.exp(-(((v - 0.8) / 0.3) ** 2) / 2)
    return float(1 + (a - 0.4) ** 2 + narrow + broad)


def _game(seed, *, n_designs=12, n_scenarios=9):
    """A search that has tried designs, each run in one scenario of its own, and knows of scenarios."""
    rng = np.random.default_rng(seed)
    runs = JointRuns(
        design=SearchSpace.of(CHOICE), uncertain=SearchSpace.of(DANGER), read=response_reader(None),
        evaluate=FunctionEvaluator(_two_peaks), budget=n_designs, seed=0,
    )  # fmt: skip
    game = CuttingSets(runs)
    game.tried = list(rng.random((n_designs, 1)))
    runs.run(np.column_stack([game.tried, rng.random(n_designs)]), "minimax start")
    runs.scenarios = list(rng.random((n_scenarios, 1)))
    return game


def _worst(game, x):
    own = [_two_peaks(*z) for z in game.runs.z[game.runs.at_design(x)]]
    return max([*own, *(_two_peaks(x[0], u[0]) for u in game.runs.scenarios)])


@pytest.mark.parametrize("seed", range(10))
def test_the_lowest_of_all_is_found_without_running_all(seed):
    game = _game(seed)
    exact = min(game.tried, key=lambda t: _worst(game, t))
    expected = _worst(game, exact)
    every = len(game.tried) * len(game.runs.scenarios)
    before = game.runs.made
    x, is_settled = repair._lowest_in_all(game, given=0, allowed=every)
    assert is_settled
    assert np.array_equal(x, exact)
    assert game.runs.worst_run(x)[0] == expected
    assert game.runs.made - before < every / 2


@pytest.mark.parametrize("allowed", [-3, 0, 1, 5])
def test_no_more_runs_are_made_than_are_allowed(allowed):
    for seed in range(5):
        game = _game(seed)
        before = game.runs.made
        _, is_settled = repair._lowest_in_all(game, given=0, allowed=allowed)
        assert game.runs.made - before <= max(allowed, 0)
        assert not is_settled


def test_a_run_of_an_attack_is_taken_up_at_no_cost():
    game = _game(0)
    runs, x = game.runs, game.tried[0]
    runs.allow(0)
    row = {"a": runs.design.rows(x[None])[0]["a"], "v": 0.1 + 0.2}
    runs.outcomes([row], purpose="minimax attack")
    made = runs.made
    runs.keep(np.array([x[0], 0.3]), {"v": row["v"]})
    assert runs.made == made
    assert runs.y[-1] == _two_peaks(**row)


@pytest.mark.parametrize("seed", [1, 6, 7])
def test_budget_and_attack_together_are_not_exceeded(seed):
    calls = []

    def f(x, u):
        calls.append((x["a"], u["v"]))
        return _two_peaks(x["a"], u["v"])

    found = minimax(f, CHOICE, DANGER, budget=BUDGET, attack=ATTACK, seed=seed, tolerance=TOLERANCE)
    assert len(calls) == len(set(calls)) == found.evaluations
    assert found.evaluations <= found.budget == BUDGET + ATTACK
    # a design that was exchanged at the last is not called what its attack would have earned
    if found.attack is None:
        assert found.status is MinimaxStatus.BEATEN
        assert found.grade is Grade.SEARCHED
    if found.status in (MinimaxStatus.CONVERGED, MinimaxStatus.MET):
        assert found.value - found.predicted <= TOLERANCE * abs(found.value)

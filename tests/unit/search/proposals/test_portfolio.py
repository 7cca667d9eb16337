"""What the turns of a worst-case search propose."""

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from surrogates.analysis.success import SuccessChance
from workbench import Parameter, Space
from workbench.search.proposals.best_point import APART, LEAN
from workbench.search.proposals.known import Known
from workbench.search.proposals.portfolio import Batch, predicted_worst, propose
from workbench.search.proposals.turns import Turn
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.fitting import believing, fit_search_model
from workbench.search.surrogate.model import SearchModel

WHERE = SearchSpace.of(Space([Parameter("x0", lower=0.0, upper=1.0), Parameter("x1", lower=0.0, upper=1.0)]))
LINE = np.linspace(0.0, 1.0, 81)
GRID = np.array(np.meshgrid(LINE, LINE)).reshape(2, -1).T


def valley(u):
    """A curved ridge, highest at (0.75, 0.6), as seen by a search for the largest value."""
    return -4.0 * (u[:, 1] - 0.3 - 0.5 * u[:, 0] ** 2) ** 2 - (u[:, 0] - 0.75) ** 2


@pytest.fixture(params=[0, 1, 2])
def runs(request) -> Iterator[tuple[np.ndarray, np.ndarray, SearchModel]]:
    u = np.random.default_rng(request.param).random((7, 2))
    return u, valley(u), fit_search_model(u, valley(u), previous=None, seed=0)


def known(u, v, model) -> Known:
    return Known(
        where=WHERE,
        model=model,
        success=SuccessChance.of(u, np.ones(len(u), dtype=bool)),
        u=u,
        u_ok=u,
        v=v,
        incumbent=u[np.argmax(v)],
        under_way=np.empty((0, 2)),
    )


def proposed(u, v, model, *, iteration=0, finishing=False, size=1) -> Batch:
    turn = Turn(number=iteration, finishing=finishing)
    return propose(known(u, v, model), turn, size=size, rng=np.random.default_rng(0))


def test_gaining_turns_alternate_between_improvement_and_bound(runs):
    assert [proposed(*runs, iteration=i).proposals[0] for i in range(4)] == ["ei", "ucb", "ei", "ucb"]


def test_the_bound_lies_half_a_deviation_above_the_mean(runs):
    model = runs[2]
    mean, std = model.predict(proposed(*runs, iteration=1).u)
    over_grid = model.predict(GRID)
    assert mean[0] + LEAN * std[0] >= (over_grid[0] + LEAN * over_grid[1]).max() - 1e-6 * model.scale
    assert std[0] > 0.0


def test_the_last_runs_and_the_reported_prediction_take_the_bare_mean(runs):
    u, v, model = runs
    best = model.predict(GRID)[0].max() - 1e-6 * model.scale
    last = proposed(*runs, finishing=True)
    assert last.proposals == ("predicted",)
    assert model.predict(last.u)[0][0] >= best
    reported = predicted_worst(known(u, v, model), rng=np.random.default_rng(0))
    assert model.predict(reported[None])[0][0] >= best


def test_the_bound_goes_where_the_model_knows_less_than_at_the_predicted_worst(runs):
    """m(a) <= m(b) and m(a) + k s(a) >= m(b) + k s(b) make s(a) >= s(b)."""
    model = runs[2]
    bound, bare = proposed(*runs, iteration=1), proposed(*runs, finishing=True)
    assert model.predict(bound.u)[1][0] > model.predict(bare.u)[1][0] * 1.01


@pytest.mark.parametrize("finishing", [False, True])
def test_the_points_of_a_batch_lie_apart_and_the_first_is_that_of_a_search_run_by_run(runs, finishing):
    batch, alone = proposed(*runs, finishing=finishing, size=5), proposed(*runs, finishing=finishing)
    assert batch.u[0].tolist() == alone.u[0].tolist()
    assert len(batch.u) == 5
    apart = cdist(batch.u, batch.u, "chebyshev")[np.triu_indices(5, 1)]
    assert apart.min() > APART - 1e-12
    if finishing:
        assert batch.proposals.count("predicted") == 1


def test_a_believed_run_keeps_the_mean_and_takes_the_doubt(runs):
    u, v, model = runs
    under_way = np.array([[0.9, 0.1]])
    features = np.vstack([u, under_way])
    believed = believing(model, features, np.append(v, model.mean(under_way)))
    assert believed.mean(GRID) == pytest.approx(model.mean(GRID), abs=1e-5 * np.ptp(v))
    assert believed.predict(under_way)[1][0] < 1e-2 * model.predict(under_way)[1][0]
    assert believed.inflation == model.inflation
    assert believed.cautious is not None
    assert believed.cautious.n_runs == len(u) + 1

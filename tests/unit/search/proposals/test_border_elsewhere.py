"""Another place of a border: on the level of the worst run, far from every failure."""

import numpy as np
import pytest

from surrogates.analysis.success import SuccessChance
from workbench import Parameter, Space
from workbench.search.proposals.border_elsewhere import LIKELY, elsewhere, likely_and_large
from workbench.search.proposals.known import Known
from workbench.search.runs.ledger import Ledger
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.growing_failures import GrowingFailures, growth_of

INPUTS = ("a", "b", "c")
SLOPES = np.array([2.0, 1.0, 0.5])


def _known(u, ok, *, levels=None):
    """What a search knows after runs at u (n, 3) of a linear response, of which `ok` (n,) succeeded."""
    space = Space([
        Parameter(name, kind="discrete", levels=levels) if levels and name == "c"
        else Parameter(name, lower=0.0, upper=1.0) for name in INPUTS
    ])  # fmt: skip
    rows = [{**dict(zip(INPUTS, map(float, at), strict=True)), "y": float(SLOPES @ at)} for at in u[ok]]
    ledger = Ledger.opened(space, response="y", sense="max", start=rows, progress=None)
    model = fit_search_model(ledger.u_ok, ledger.v, previous=None, seed=0)
    known = Known.of(ledger, model, SuccessChance.of(u, ok))
    return known, GrowingFailures.of(u, ok, growth_of(lambda at: model.predict(at)[0], u[ok]))


@pytest.fixture
def runs():
    """Runs (n, 3) that end at one place of the border a + b + c = 1.5, and whether they succeed: there the
    response is 1.63, and 2.75 where a = 1 and b = 0.5."""
    u = np.random.default_rng(4).random((40, 3))
    u = np.vstack([u[u @ SLOPES < 1.6], [[0.25, 1.0, 0.25], [0.3, 1.0, 0.3]]])
    return u, u.sum(axis=1) <= 1.5


def test_the_point_is_on_the_level_and_farther_from_failures_than_the_worst_run(runs):
    u, ok = runs
    known, failures = _known(u, ok)
    level = known.model.best + 0.02
    point = elsewhere(known, failures, u[~ok], level=level, rng=np.random.default_rng(1))
    assert level < SLOPES @ point < level + 0.01

    def away(at):
        return np.linalg.norm(u[~ok] - at, axis=1).min()

    assert away(point) > 3 * away(known.incumbent)
    assert np.abs(u - point).max(axis=1).min() > 1e-3


def test_one_seed_gives_one_point(runs):
    u, ok = runs
    known, failures = _known(u, ok)
    twice = [
        elsewhere(known, failures, u[~ok], level=known.model.best, rng=np.random.default_rng(7))
        for _ in range(2)
    ]
    assert np.array_equal(*twice)


def test_levels_and_limits_of_the_space_are_kept(runs):
    u, ok = runs
    u[:, 2] = np.round(u[:, 2])
    ok = u.sum(axis=1) <= 1.5
    known, failures = _known(u, ok, levels=(0.0, 1.0))
    point = elsewhere(known, failures, u[~ok], level=known.model.best, rng=np.random.default_rng(2))
    assert point[2] in (0.0, 1.0)


def test_there_is_none_where_nothing_failed_or_the_model_predicts_no_more(runs):
    u, ok = runs
    known, failures = _known(u, ok)
    rng = np.random.default_rng(0)
    assert elsewhere(known, failures, u[:0], level=known.model.best, rng=rng) is None
    assert elsewhere(known, failures, u[~ok], level=float(SLOPES.sum()) + 0.1, rng=rng) is None


def test_the_likely_run_is_the_largest_prediction_among_likely_even_points(runs):
    u, ok = runs
    known, failures = _known(u, ok)
    point = likely_and_large(known, failures, rng=np.random.default_rng(3))
    assert failures.probability(point[None])[0] >= LIKELY
    even = np.random.default_rng(5).random((3000, 3))
    likely = even[failures.probability(even) >= LIKELY]
    assert SLOPES @ point > np.quantile(likely @ SLOPES, 0.98)


def test_there_is_none_where_no_even_point_is_likely_to_succeed(runs):
    class Doubtful:
        """As likely to fail as not, everywhere."""

        def probability(self, features):
            return np.full(len(features), 0.5)

    known, _ = _known(*runs)
    assert likely_and_large(known, Doubtful(), rng=np.random.default_rng(0)) is None

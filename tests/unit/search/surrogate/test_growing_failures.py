"""The chance of success where failures grow out of the response."""

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.search.surrogate.growing_failures import GrowingFailures, growth_of


def _planes(count, runs, d):
    """Runs, whether they succeed, and points with theirs, on random planes across a random slope."""
    for number in range(count):
        rng = np.random.default_rng([number, d])
        slope, normal = rng.uniform(0.3, 1.3, (2, d))
        u, asked = rng.random((runs, d)), rng.random((2000, d))
        limit = np.quantile(asked @ normal, 0.7)
        yield slope, u, u @ normal < limit, asked, asked @ normal < limit


def test_runs_are_on_their_own_side():
    for slope, u, ok, _, _ in _planes(3, 20, 4):
        failures = GrowingFailures.of(u, ok, growth_of(lambda x, a=slope: x @ a, u[ok]))
        assert ((failures.probability(u) > 0.5) == ok).all()


def test_what_is_said_is_what_comes():
    said, came = [], []
    for slope, u, ok, asked, succeeds in _planes(12, 14, 5):
        failures = GrowingFailures.of(u, ok, growth_of(lambda x, a=slope: x @ a, u[ok]))
        said.append(failures.probability(asked))
        came.append(succeeds)
    chance, succeeded = np.concatenate(said), np.concatenate(came)
    for low, high in ((0.2, 0.4), (0.4, 0.6), (0.6, 0.8)):
        inside = (chance > low) & (chance < high)
        # twelve planes: the runs of one plane err together, which leaves 0.05 of scatter or so
        assert abs(succeeded[inside].mean() - chance[inside].mean()) < 0.15


def test_a_border_across_the_response_is_learnt_from_few_runs():
    """Where the response itself is what fails, fewer runs tell the border than without its growth."""
    wrong = {"growing": 0.0, "plain": 0.0}
    for number in range(4):
        rng = np.random.default_rng([7, number])
        slope, u, asked = rng.uniform(0.3, 1.3, 8), rng.random((12, 8)), rng.random((1000, 8))

        def response(x, slope=slope):
            return np.prod(1 + x * slope, axis=1)

        limit = np.quantile(response(asked), 0.6)
        ok, succeeds = response(u) < limit, response(asked) < limit
        growing = GrowingFailures.of(u, ok, growth_of(response, u[ok]))
        wrong["growing"] += ((growing.probability(asked) > 0.5) != succeeds).mean()
        wrong["plain"] += ((SuccessChance.of(u, ok).probability(asked) > 0.5) != succeeds).mean()
    assert wrong["growing"] < 0.7 * wrong["plain"]


def test_growth_is_counted_in_deviations_of_the_runs_and_bounded():
    runs = np.array([[0.0], [0.5], [1.0]])
    growth = growth_of(lambda x: 10 * x[:, 0], runs)
    assert np.isclose(growth(np.array([[0.5]]))[0], 0.0)
    assert growth(np.array([[9.0], [-9.0]])).tolist() == [4.0, -4.0]


def test_a_plane_is_taken_until_the_runs_contradict_one():
    """Few runs beside a plane in seven inputs leave no weight to bends; those around a pocket do."""
    rng = np.random.default_rng(3)
    slope, u = rng.uniform(0.3, 1.3, 7), rng.random((16, 7))
    ok = u @ slope < np.quantile(u @ slope, 0.75)
    flat = GrowingFailures.of(u, ok, growth_of(lambda x: x @ slope, u[ok]))
    assert _weight_of_bends(flat) < 0.3

    u = rng.random((40, 2))
    ok = ((u - 0.5) ** 2).sum(axis=1) > 0.06
    pocket = GrowingFailures.of(u, ok, growth_of(lambda x: x @ np.array([1.0, 0.5]), u[ok]))
    assert _weight_of_bends(pocket) > 0.9
    assert pocket.probability(np.array([[0.5, 0.5]]))[0] < 0.1
    assert pocket.probability(np.array([[0.05, 0.05], [0.95, 0.95]])).min() > 0.9


def _weight_of_bends(failures):
    bent = [one.scales[0] > 0 for one in failures.posteriors]
    return float(failures.weights[bent].sum())

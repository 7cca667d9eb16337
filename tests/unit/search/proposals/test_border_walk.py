"""A search goes along the border of failures, not only up to it."""

import numpy as np
import pytest

from surrogates.analysis.success import SuccessChance
from workbench import Parameter, Space
from workbench.search.proposals.best_point import start_pool
from workbench.search.proposals.border_walk import LAST, LEAST, MOST_FAILED, PASSED_OVER, BorderWalk
from workbench.search.proposals.known import Known
from workbench.search.runs.ledger import Ledger
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.growing_failures import GrowingFailures, growth_of
from workbench.search.worst_case import worst_case

SPACE = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])


def _askew(a, b):
    """Grows with a more than with b, and fails beyond a + b = 1.2: the worst is at a = 1, b = 0.2."""
    if a + b > 1.2:
        raise RuntimeError("step size underflow")
    return 2.0 * a + b


def _known(points, failed):
    """What a search knows after `points` (n, 2) of `_askew`."""
    rows = [{"a": float(a), "b": float(b)} for a, b in points]
    made = [
        {**row, "y": 2.0 * row["a"] + row["b"]} for row, lost in zip(rows, failed, strict=True) if not lost
    ]
    ledger = Ledger.opened(SPACE, response="y", sense="max", start=made, progress=None)
    u, ok = np.asarray(points), ~np.asarray(failed)
    model = fit_search_model(ledger.u_ok, ledger.v, previous=None, seed=0)
    known = Known.of(ledger, model, SuccessChance.of(u, ok))
    failures = GrowingFailures.of(u, ok, growth_of(lambda at: model.predict(at)[0], u[ok]))
    return known, failures


def test_the_next_run_slides_along_a_border_that_lies_askew():
    """From the border at (0.6, 0.6) single coordinates gain nothing: one must fall."""
    points = [(0.1, 0.2), (0.5, 0.3), (0.59, 0.59), (0.61, 0.61), (0.2, 0.98), (0.22, 1.0)]
    known, failures = _known(points, [a + b > 1.2 for a, b in points])
    walk = BorderWalk(failures=failures, failed=0.2, left=10)
    rng = np.random.default_rng(0)
    pool = start_pool(known.where, known.incumbent, rng)
    point = walk.next_point(known, pool, rng=rng)
    assert point is not None
    assert 2.0 * point[0] + point[1] > 1.77 + 0.05
    assert point[0] > 0.65
    assert point[0] + point[1] < 1.25
    assert failures.probability(point[None])[0] >= LEAST


def test_no_run_is_proposed_where_nothing_gains():
    points = [(0.1, 0.2), (0.3, 0.8), (0.5, 0.3), (1.0, 0.2), (1.0, 0.21), (0.9, 0.9), (0.2, 1.0)]
    known, failures = _known(points, [a + b > 1.205 for a, b in points])
    walk = BorderWalk(failures=failures, failed=0.0, left=10)
    assert walk.next_point(known, np.array([[0.5, 0.2]]), rng=np.random.default_rng(0)) is None


@pytest.mark.parametrize(
    ("failed", "left", "has_turn"),
    [(MOST_FAILED, 10, True), (MOST_FAILED + 0.01, 10, False), (MOST_FAILED + 0.01, LAST, True)],
)
def test_others_have_the_turn_while_too_many_runs_have_failed_but_at_the_end(failed, left, has_turn):
    points = [(0.1, 0.2), (0.5, 0.3), (0.59, 0.59), (0.61, 0.61), (0.2, 0.98), (0.22, 1.0)]
    known, failures = _known(points, [a + b > 1.2 for a, b in points])
    rng = np.random.default_rng(0)
    pool = start_pool(known.where, known.incumbent, rng)
    point = BorderWalk(failures=failures, failed=failed, left=left).next_point(known, pool, rng=rng)
    assert (point is not None) == has_turn


def test_a_place_known_to_the_last_digit_is_left_until_the_last_runs():
    """Between a run that succeeds and one that fails next to it nothing gains d; the end takes what is."""
    points = [(0.1, 0.2), (0.3, 0.8), (0.5, 0.3), (1.0, 0.195), (1.0, 0.202), (0.9, 0.9), (0.2, 1.0)]
    points += [(0.8, 0.39), (0.8, 0.41), (0.9, 0.29), (0.9, 0.31)]
    known, failures = _known(points, [a + b > 1.2 for a, b in points])
    rng = np.random.default_rng(0)
    pool = start_pool(known.where, known.incumbent, rng)

    def gain(left):
        walk = BorderWalk(failures=failures, failed=0.0, left=left)
        point = walk.next_point(known, pool, rng=np.random.default_rng(0))
        return None if point is None else known.model.mean(point[None])[0] - known.model.best

    early, late = gain(10), gain(LAST)
    assert early is None or early > PASSED_OVER * 2.195
    assert late is not None
    assert late < 2 * PASSED_OVER * 2.195


def test_a_search_meets_the_worst_on_a_border_askew():
    found = worst_case(_askew, SPACE, budget=15, seed=3)
    assert found.value > 2.2 * 0.99
    assert any(run.proposal == "border" for run in found.runs)


def test_a_search_without_failures_knows_no_border():
    found = worst_case(lambda a, b: 2.0 * a + b - a * b, SPACE, budget=12, seed=0)
    assert all(run.proposal != "border" for run in found.runs)

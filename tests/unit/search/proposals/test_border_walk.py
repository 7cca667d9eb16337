"""A search goes along the border of failures, not only up to it."""

import numpy as np
import pytest

from surrogates.analysis.success import SuccessChance
from workbench import Parameter, Space
from workbench.search.proposals.best_point import start_pool
from workbench.search.proposals.border_elsewhere import LIKELY
from workbench.search.proposals.border_walk import (
    ELSEWHERE,
    FEW_FAILED,
    LAST,
    LEAST,
    MOST_FAILED,
    PASSED_OVER,
    BorderWalk,
)
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
    return known, failures, u[~ok]


def test_the_next_run_slides_along_a_border_that_lies_askew():
    """From the border at (0.6, 0.6) single coordinates gain nothing: one must fall."""
    points = [(0.1, 0.2), (0.5, 0.3), (0.59, 0.59), (0.61, 0.61), (0.2, 0.98), (0.22, 1.0)]
    known, failures, lost = _known(points, [a + b > 1.2 for a, b in points])
    walk = BorderWalk(failures=failures, lost=lost, failed=0.2, made=0, left=10)
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
    known, failures, lost = _known(points, [a + b > 1.205 for a, b in points])
    walk = BorderWalk(failures=failures, lost=lost, failed=0.0, made=0, left=10)
    assert walk.next_point(known, np.array([[0.5, 0.2]]), rng=np.random.default_rng(0)) is None


def _crowded():
    """What is known where runs crowd at (0.2, 1.0); as much is predicted at (0.7, 0), far from failures."""
    points = [(0.1, 0.2), (0.3, 0.8), (0.5, 0.3), (0.19, 1.0), (0.05, 0.6), (0.3, 0.05), (0.15, 0.75)]
    points += [(0.21, 1.0), (0.25, 0.97), (0.6, 0.9)]
    return _known(points, [a + b > 1.2 for a, b in points])


def _proposed(*, failed, left, seeds=12):
    """What the walk proposes with each seed, beside what is known."""
    points = [(0.1, 0.2), (0.5, 0.3), (0.59, 0.59), (0.61, 0.61), (0.2, 0.98), (0.22, 1.0)]
    known, failures, lost = _known(points, [a + b > 1.2 for a, b in points])
    walk = BorderWalk(failures=failures, lost=lost, failed=failed, made=0, left=left)
    made = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        made.append(walk.next_point(known, start_pool(known.where, known.incumbent, rng), rng=rng))
    return made, known, failures


@pytest.mark.parametrize(("failed", "left"), [(MOST_FAILED, 10), (MOST_FAILED + 0.01, LAST)])
def test_the_walk_gains_until_too_many_runs_have_failed_and_at_the_end(failed, left):
    made, known, _ = _proposed(failed=failed, left=left, seeds=4)
    assert all(known.model.mean(point[None])[0] > known.model.best for point in made)


def test_while_the_walk_waits_half_of_the_turns_are_of_others_and_half_of_likely_runs():
    made, known, failures = _proposed(failed=MOST_FAILED + 0.01, left=10)
    own = np.array([point for point in made if point is not None])
    assert 3 <= len(own) <= 9
    assert failures.probability(own).min() >= LIKELY
    even = np.random.default_rng(0).random((4000, 2))
    likely = known.model.mean(even[failures.probability(even) >= LIKELY])
    assert known.model.mean(own).min() > np.quantile(likely, 0.95)


def test_no_other_place_is_tried_once_more_than_a_quarter_of_the_runs_has_failed():
    known, failures, lost = _crowded()

    def point(failed):
        rng = np.random.default_rng(0)
        walk = BorderWalk(failures=failures, lost=lost, failed=failed, made=ELSEWHERE - 1, left=10)
        return walk.next_point(known, start_pool(known.where, known.incumbent, rng), rng=rng)

    few, many = point(FEW_FAILED), point(FEW_FAILED + 0.01)
    level = known.model.best * (1 + 2 * PASSED_OVER)
    assert known.model.mean(few[None])[0] < level < known.model.mean(many[None])[0]


def test_a_place_known_to_the_last_digit_is_left_until_the_last_runs():
    """Between a run that succeeds and one that fails next to it nothing gains d; the end takes what is."""
    points = [(0.1, 0.2), (0.3, 0.8), (0.5, 0.3), (1.0, 0.195), (1.0, 0.202), (0.9, 0.9), (0.2, 1.0)]
    points += [(0.8, 0.39), (0.8, 0.41), (0.9, 0.29), (0.9, 0.31)]
    known, failures, lost = _known(points, [a + b > 1.2 for a, b in points])
    rng = np.random.default_rng(0)
    pool = start_pool(known.where, known.incumbent, rng)

    def gain(left):
        walk = BorderWalk(failures=failures, lost=lost, failed=0.0, made=0, left=left)
        point = walk.next_point(known, pool, rng=np.random.default_rng(0))
        return None if point is None else known.model.mean(point[None])[0] - known.model.best

    early, late = gain(10), gain(LAST)
    assert early is None or early > PASSED_OVER * 2.195
    assert late is not None
    assert late < 2 * PASSED_OVER * 2.195


@pytest.mark.parametrize(
    ("made", "left", "is_elsewhere"),
    [
        (ELSEWHERE - 1, 10, True),
        (2 * ELSEWHERE - 1, 10, True),
        (ELSEWHERE, 10, False),
        (ELSEWHERE - 1, LAST, False),
    ],
)
def test_every_fourth_run_of_the_border_is_at_another_place_but_at_the_end(made, left, is_elsewhere):
    known, failures, lost = _crowded()
    rng = np.random.default_rng(0)
    walk = BorderWalk(failures=failures, lost=lost, failed=0.2, made=made, left=left)
    point = walk.next_point(known, start_pool(known.where, known.incumbent, rng), rng=rng)
    assert point is not None
    is_on_level = known.model.mean(point[None])[0] < known.model.best + 2 * PASSED_OVER * known.model.best
    assert (is_on_level and point[1] < 0.2) == is_elsewhere


def test_a_search_meets_the_worst_on_a_border_askew():
    found = worst_case(_askew, SPACE, budget=15, seed=3)
    assert found.value > 2.2 * 0.99
    assert any(run.proposal == "border" for run in found.runs)


def test_a_search_without_failures_knows_no_border():
    found = worst_case(lambda a, b: 2.0 * a + b - a * b, SPACE, budget=12, seed=0)
    assert all(run.proposal != "border" for run in found.runs)

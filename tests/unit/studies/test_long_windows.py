"""Searches on long windows from several starts: what is compared with what."""

import numpy as np
import pytest

from studies.long_windows import Reached, problem, run, started, summary


def row(window: float, start: int, probes: int, value: float) -> Reached:
    return Reached(
        window=window, start=start, probes=probes, value=value, evaluations=200, kkt=1e-4,
        status="CONVERGED", cpu=1.0,
    )  # fmt: skip


def test_the_lines_count_what_came_near_the_best_and_what_was_worse_than_the_plain_search():
    rows = [
        row(1.0, 0, 4000, 0.50), row(1.0, 0, 0, 0.49), row(1.0, 1, 4000, 0.50), row(1.0, 1, 0, 0.70),
        row(2.0, 0, 4000, 0.30),
    ]  # fmt: skip
    assert summary(rows) == [
        "1 s: best 0.4900; with runs without gradients 2 of 2 within 3 %, the worst 2.0 % above; plain 1 of "
        "2 within 3 %, the worst 42.9 % above; against the plain search from the same start at most +2.0 %",
        "2 s: best 0.3000; with runs without gradients 1 of 1 within 3 %, the worst 0.0 % above",
    ]


def test_starts_differ_and_keep_the_budget():
    whole = problem(54, 0.5)
    assert whole.costs.sum() == 54
    designs = [started(whole, start).start for start in range(4)]
    assert np.allclose(designs[0], 0.1)
    assert all(whole.excess(design) <= 1e-12 for design in designs)
    assert min(np.abs(a - b).max() for i, a in enumerate(designs) for b in designs[:i]) > 0.05


def test_both_searches_get_the_same_evaluations():
    rows = list(run(54, (0.5,), 2, plain=1, evaluations=12))
    assert [(r.start, r.probes > 0) for r in rows] == [(0, True), (0, False), (1, True)]
    assert all(r.evaluations <= 12 and 0 < r.value < 10 for r in rows)


def test_other_counts_of_springs_are_refused():
    with pytest.raises(ValueError, match="springs needs to be one of 54, 260, 1020, got 100"):
        problem(100, 1.0)

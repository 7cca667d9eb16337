"""Linear programmes of many variables under few rows: sifted, beside HiGHS on the whole."""

import numpy as np
import pytest

from workbench.engine.layout.outcome import linear_programme as programmes
from workbench.engine.layout.outcome.linear_programme import linear_programme
from workbench.engine.layout.outcome.sifting import sifted

N = 12_000
ROUNDING = 1e-9


def drawn(seed, n=N):
    """Rows under a bound, with budgets, of either sign, some sparse: cost, rows, right-hand side, bounds."""
    rng = np.random.default_rng(seed)
    r, m = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    slopes = rng.uniform(0.1, 10, (r, n)) * np.where(rng.random((r, n)) < 0.2 * (seed % 3), 0.5, -1.0)
    slopes *= rng.random((r, n)) < (0.3 if seed % 2 else 1.0)
    costs = rng.uniform(0.5, 2, (m, n)) * (rng.random((m, n)) < 0.7)
    rows = np.block([[slopes, -np.ones((r, 1))], [costs, np.zeros((m, 1))]])
    right = np.r_[-rng.uniform(0, 0.1, r) * np.abs(slopes).sum(axis=1).max(),
                  rng.uniform(0.02, 0.3) * costs.sum(axis=1)]  # fmt: skip
    box = np.vstack([np.column_stack([np.zeros(n), rng.uniform(0.1, 1, n)]), [[-np.inf, np.inf]]])
    return np.r_[np.zeros(n), 1.0], rows, right, box


def whole(monkeypatch, *problem, **more):
    monkeypatch.setattr(programmes, "_MANY", 10 * N)
    found = linear_programme(*problem, **more)
    monkeypatch.undo()
    return found


@pytest.mark.parametrize("seed", range(6))
def test_it_is_the_whole_programme(seed, monkeypatch):
    cost, rows, right, box = drawn(seed)
    found = linear_programme(cost, at_most=(rows, right), bounds=box)
    other = whole(monkeypatch, cost, at_most=(rows, right), bounds=box)
    assert found.value == pytest.approx(other.value, rel=ROUNDING)
    assert (rows @ found.x - right <= ROUNDING * np.abs(rows).sum(axis=1)).all()
    assert (found.x >= box[:, 0]).all()
    assert (found.x <= box[:, 1]).all()
    # the prices prove it: the least value that any design can have at them
    reduced = cost + found.prices @ rows
    assert abs(reduced[-1]) <= ROUNDING
    proved = (reduced[:-1, None] * box[:-1]).min(axis=1).sum() - found.prices @ right
    assert proved == pytest.approx(found.value, rel=1e-7)
    inside = (found.x > box[:, 0]) & (found.x < box[:, 1])
    assert inside.sum() <= len(right) + 1  # a vertex, bounds met to the last bit


def test_units_of_rows_and_columns_do_not_matter(monkeypatch):
    cost, rows, right, box = drawn(1)
    rng = np.random.default_rng(1)
    of_rows, of_columns = 10.0 ** rng.uniform(-6, 6, len(right)), 10.0 ** rng.uniform(-3, 3, N + 1)
    scaled = rows * of_rows[:, None] * of_columns
    found = linear_programme(
        cost * of_columns, at_most=(scaled, right * of_rows), bounds=box / of_columns[:, None]
    )
    assert found.value == pytest.approx(whole(monkeypatch, cost, at_most=(rows, right), bounds=box).value)


def test_equal_sums_and_a_vertex(monkeypatch):
    rng = np.random.default_rng(8)
    sums, density = rng.standard_normal((5, N)), rng.uniform(0, 1, N)
    cost = rng.standard_normal(N)
    box = np.column_stack([np.zeros(N), np.ones(N)])
    problem = {"equal": (sums, sums @ density), "bounds": box, "vertex": True}
    found = linear_programme(cost, **problem)
    assert found.value == pytest.approx(whole(monkeypatch, cost, **problem).value, rel=ROUNDING)
    assert np.abs(sums @ (found.x - density)).max() <= 1e-6
    assert ((found.x > 0) & (found.x < 1)).sum() <= 5


def test_a_programme_without_a_solution_has_none():
    box = np.column_stack([np.zeros(N), np.ones(N)])
    assert linear_programme(np.ones(N), at_most=(-np.ones((1, N)), np.array([-2.0 * N])), bounds=box) is None


def test_few_variables_are_left_to_the_solver():
    cost, rows, right, box = drawn(0, n=50)
    assert sifted(cost, rows, right, *box.T, lambda *_: pytest.fail("not to be asked")) is None


def test_where_every_variable_is_in_doubt_the_whole_is_solved():
    box = np.column_stack([np.zeros(N), np.ones(N)])
    found = linear_programme(-np.ones(N), at_most=(np.ones((1, N)), np.array([0.5 * N])), bounds=box)
    assert found.value == pytest.approx(-0.5 * N)

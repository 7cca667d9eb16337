"""The first-order error of histories: that of all rows, from few of them."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import linprog

from workbench.engine.layout.formulation.peaks import local_peaks, neighbours, rows_with_neighbours
from workbench.engine.layout.formulation.problem import TabulatedRows, static_problem
from workbench.engine.layout.outcome import first_order as module
from workbench.engine.layout.outcome.first_order import first_order
from workbench.engine.layout.outcome.optimality import certificate

SOLVER = 1e-7  # of the value: the tolerances of two linear programmes
MEMBERS, SCENARIOS, NODES = 12, 2, 90
NONE = np.zeros(0), np.zeros((0, MEMBERS))


@dataclass(frozen=True)
class Asked(TabulatedRows):
    """Rows that remember how many gradients were asked for."""

    asked: list = field(default_factory=list)

    def gradients(self, rows):
        self.asked.append(len(rows))
        return super().gradients(rows)


def drawn(seed, *, least=(), carried=True):
    """Smooth histories whose slopes vary in time, at an even design; rows `least` lie below all others."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, NODES)
    waves = np.array([np.sin(2 * np.pi * k * t + p) for k, p in enumerate(rng.uniform(0, 6, 8), start=1)])
    values = 2.0 + 0.3 * rng.standard_normal((SCENARIOS, 8)) @ waves
    slopes = np.einsum("smk,kt->stm", rng.standard_normal((SCENARIOS, MEMBERS, 8)), waves)
    values[:, list(least)] = values.min(axis=1, keepdims=True) - 1.0
    slopes[:, list(least)] *= 100.0
    problem = static_problem(
        lambda x: (1.0, np.ones(MEMBERS)), start=np.full(MEMBERS, 0.5), budgets=[(np.ones(MEMBERS), 6.0)]
    )
    factors = np.zeros((SCENARIOS * NODES, 1, MEMBERS)) if carried else None
    return problem, Asked(values=values, gradient_table=slopes.reshape(-1, MEMBERS), factor_table=factors)


def by_all_rows(problem, evaluation, rows):
    """What scipy's linear programme on these rows promises, over the value."""
    flat, top = evaluation.values.ravel()[rows], evaluation.values.max()
    table = evaluation.gradient_table[rows]
    found = linprog(
        np.r_[np.zeros(MEMBERS), 1.0],
        A_ub=np.vstack([np.hstack([table, -np.ones((len(rows), 1))]), np.r_[np.ones(MEMBERS), 0.0]]),
        b_ub=np.r_[top - flat, 0.0], bounds=[*[(-0.5, 0.5)] * MEMBERS, (None, None)],
    )  # fmt: skip
    return -found.fun / top


@pytest.mark.parametrize("seed", range(8))
def test_it_is_that_of_all_rows_and_less_than_that_of_the_peaks(seed):
    problem, evaluation = drawn(seed)
    everything = np.arange(evaluation.values.size)
    known = by_all_rows(problem, evaluation, everything)
    found = first_order(problem, problem.start, evaluation, enough=0.0)
    assert found.kkt == pytest.approx(known, rel=1e-4, abs=SOLVER)
    peaks = local_peaks(evaluation.values, above=0.9 * evaluation.values.max())
    few = certificate(
        problem, problem.start, evaluation.values.ravel()[peaks], evaluation.gradient_table[peaks], *NONE
    )
    assert few.kkt > known + 0.05


def test_rows_outside_a_window_are_none_of_the_problem():
    problem, evaluation = drawn(1, least=range(30))
    inside = np.flatnonzero(np.tile(np.arange(NODES) >= 30, SCENARIOS))
    found = first_order(problem, problem.start, evaluation, enough=0.0)
    assert found.kkt == pytest.approx(by_all_rows(problem, evaluation, inside), rel=1e-4, abs=SOLVER)
    everything = by_all_rows(problem, evaluation, np.arange(evaluation.values.size))
    assert everything < 0.9 * found.kkt  # which they would have made look better


def test_a_large_table_is_looked_at_in_strides(monkeypatch):
    problem, evaluation = drawn(2)
    whole = first_order(problem, problem.start, evaluation, enough=0.0).kkt
    monkeypatch.setattr(module, "_NUMBERS", MEMBERS * SCENARIOS * NODES // 5)
    evaluation.asked.clear()
    found = first_order(problem, problem.start, evaluation, enough=0.0).kkt
    assert whole - SOLVER <= found < 1.2 * whole
    assert max(evaluation.asked) < 0.7 * SCENARIOS * NODES


def test_no_further_rows_are_looked_at_where_the_error_is_small_enough():
    problem, evaluation = drawn(3)
    first_order(problem, problem.start, evaluation, enough=np.inf)
    assert evaluation.asked == [len(local_peaks(evaluation.values, above=0.9 * evaluation.values.max()))]


def test_peaks_and_their_neighbours_do_where_every_row_takes_a_sweep():
    problem, evaluation = drawn(4, carried=False)
    flat = evaluation.values.ravel()
    peaks = local_peaks(evaluation.values)
    rows = rows_with_neighbours(evaluation.values, peaks, neighbours(NODES))
    rows = rows[flat[rows] > np.repeat(evaluation.values.min(axis=1), NODES)[rows]]
    found = first_order(problem, problem.start, evaluation, enough=0.0)
    assert found.kkt == pytest.approx(by_all_rows(problem, evaluation, rows), rel=1e-4, abs=SOLVER)
    assert max(evaluation.asked) == len(rows) < evaluation.values.size / 2

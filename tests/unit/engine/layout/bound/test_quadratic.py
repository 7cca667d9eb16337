"""The bound formulation's subproblem: against a slow solver, and where rounding leaves no pivot."""

import numpy as np
import pytest

from workbench.engine.layout.bound.quadratic import BoundState, NewtonSystem, quadratic_bound


def test_the_bound_formulation_agrees_with_a_slow_solver():
    from scipy.optimize import minimize

    rng = np.random.default_rng(4)
    n, r, k = 6, 4, 2
    c, G, W = rng.normal(size=r), rng.normal(size=(r, n)), rng.normal(size=(r, k, n))
    A, b, lo, hi = rng.random((1, n)), np.array([0.1]), np.full(n, -0.3), np.full(n, 0.4)
    hi[0] = lo[0] = 0.0
    found = quadratic_bound(c, G, W, A, b, lo, hi)

    def rows(d):
        return c + G @ d + 0.5 * ((W @ d) ** 2).sum(axis=1)

    slow = minimize(
        lambda z: z[-1], np.r_[np.zeros(n), 5.0], method="SLSQP",
        bounds=[*zip(lo, hi, strict=True), (None, None)],
        constraints=[
            {"type": "ineq", "fun": lambda z: z[-1] - rows(z[:-1])},
            {"type": "ineq", "fun": lambda z: b - A @ z[:-1]},
        ],
        options={"ftol": 1e-13, "maxiter": 500},
    )  # fmt: skip
    assert rows(found.step).max() == pytest.approx(slow.fun, abs=1e-6)
    assert found.step[0] == 0.0
    assert found.row_multipliers.sum() == pytest.approx(1.0)


def test_equal_rows_share_their_load_where_rounding_leaves_a_zero_pivot():
    """Two equal rows with slacks that have vanished make the Newton matrix singular to the last bit."""
    state = BoundState(
        d=np.zeros(2), t=0.0, s=np.zeros(2), y=np.full(2, 0.5), zl=np.full(2, 0.1), zu=np.full(2, 0.1)
    )
    rows = np.array([[1.0, 2.0], [1.0, 2.0]])
    system = NewtonSystem(state, -np.ones(2), np.ones(2), np.zeros((2, 0)), rows, 2, np.zeros(2))
    step = system.direction(0.0)
    assert np.isfinite(step.d).all()
    assert np.isfinite(step.y).all()
    bound = quadratic_bound(
        np.zeros(4), np.vstack([rows, rows]), None, np.zeros((0, 2)), np.zeros(0), -np.ones(2), np.ones(2)
    )
    assert bound.bound == pytest.approx(-3.0, abs=1e-8)


def test_budgets_that_no_free_variable_draws_on_change_nothing():
    """Variables 2 and 3 are held; the second budget is theirs alone, the third one nobody's."""
    r = np.random.default_rng(5)
    c, G, W = r.normal(size=4), r.normal(size=(4, 4)), r.normal(size=(4, 2, 4))
    lo, hi = np.array([-1.0, -1.0, 0.0, 0.0]), np.array([1.0, 1.0, 0.0, 0.0])
    one = np.array([[1.0, 1.0, 0.0, 0.0]])
    alone = quadratic_bound(c, G, W, one, np.array([0.2]), lo, hi)
    more = np.vstack([one, [[0.0, 0.0, 1.0, 2.0]], np.zeros((1, 4))])
    found = quadratic_bound(c, G, W, more, np.array([0.2, 0.0, 3.0]), lo, hi)
    np.testing.assert_allclose(found.step, alone.step, atol=1e-12)
    assert found.bound == alone.bound
    assert found.budget_multipliers.tolist() == [alone.budget_multipliers[0], 0.0, 0.0]

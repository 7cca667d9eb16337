"""The bound formulation's subproblem: against a slow solver, and where rounding leaves no pivot."""

import numpy as np
import pytest

from workbench.engine.layout.bound.quadratic import BoundState, NewtonSystem, _common_basis, quadratic_bound


def slow_step(c, G, W, A, b, lo, hi):
    """The same problem by SLSQP: the bound."""
    from scipy.optimize import minimize

    n = G.shape[1]

    def rows(d):
        return c + G @ d + 0.5 * ((W @ d) ** 2).sum(axis=1)

    def slopes(z):
        bent = G + np.einsum("rk,rkn->rn", W @ z[:-1], W)
        return np.hstack([-bent, np.ones((len(c), 1))])

    return float(minimize(
        lambda z: z[-1], np.r_[np.zeros(n), c.max() + 1.0], jac=lambda z: np.eye(n + 1)[-1], method="SLSQP",
        bounds=[*zip(lo, hi, strict=True), (None, None)],
        constraints=[
            {"type": "ineq", "fun": lambda z: z[-1] - rows(z[:-1]), "jac": slopes},
            {"type": "ineq", "fun": lambda z: b - A @ z[:-1], "jac": lambda z: -np.pad(A, ((0, 0), (0, 1)))},
        ],
        options={"ftol": 1e-13, "maxiter": 500},
    ).fun)  # fmt: skip


def test_the_bound_formulation_agrees_with_a_slow_solver():
    rng = np.random.default_rng(4)
    n, r, k = 6, 4, 2
    c, G, W = rng.normal(size=r), rng.normal(size=(r, n)), rng.normal(size=(r, k, n))
    A, b, lo, hi = rng.random((1, n)), np.array([0.1]), np.full(n, -0.3), np.full(n, 0.4)
    hi[0] = lo[0] = 0.0
    found = quadratic_bound(c, G, W, A, b, lo, hi)
    value = (c + G @ found.step + 0.5 * ((W @ found.step) ** 2).sum(axis=1)).max()
    assert value == pytest.approx(slow_step(c, G, W, A, b, lo, hi), abs=1e-6)
    assert found.step[0] == 0.0
    assert found.row_multipliers.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("members", "rows"), [(40, 10), (12, 30)])
def test_rows_that_span_a_few_directions_are_solved_in_those(members: int, rows: int):
    """Slopes and factors of a rigid body's response: five directions, fewer rows than members or more."""
    rng = np.random.default_rng(members)
    directions = rng.normal(size=(5, members))
    c = rng.normal(size=rows)
    G, W = rng.normal(size=(rows, 5)) @ directions, rng.normal(size=(rows, 2, 5)) @ directions
    A, b = np.vstack([np.ones(members), rng.random(members)]), np.array([0.1, 0.2])
    lo, hi = np.full(members, -0.1), np.full(members, 0.3)
    basis = _common_basis(np.vstack([G, W.reshape(-1, members)]))
    assert basis is not None
    assert len(basis) == 5
    found = quadratic_bound(c, G, W, A, b, lo, hi)
    value = (c + G @ found.step + 0.5 * ((W @ found.step) ** 2).sum(axis=1)).max()
    assert value == pytest.approx(slow_step(c, G, W, A, b, lo, hi), abs=1e-6)
    assert (A @ found.step <= b + 1e-8).all()


def test_rows_without_slopes_have_no_directions():
    assert _common_basis(np.zeros((4, 3))) is None
    flat = quadratic_bound(
        np.array([1.0, 2.0]), np.zeros((2, 3)), np.zeros((2, 2, 3)), np.ones((1, 3)), np.ones(1),
        -np.ones(3), np.ones(3),
    )  # fmt: skip
    assert flat.bound == pytest.approx(2.0, abs=1e-6)


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


@pytest.mark.filterwarnings("error")
def test_a_variable_that_is_at_its_bound_to_the_last_digit_has_a_direction():
    state = BoundState(
        d=np.array([-1.0, 1.0, 0.0]), t=0.0, s=np.ones(2), y=np.full(2, 0.5), zl=np.full(3, 0.1),
        zu=np.full(3, 0.1),
    )  # fmt: skip
    rows = np.array([[1.0, 2.0, 0.5], [-1.0, 0.0, 3.0]])
    system = NewtonSystem(state, -np.ones(3), np.ones(3), np.zeros((3, 0)), rows, 2, np.zeros(2))
    step = system.direction(0.0)
    assert all(np.isfinite(part).all() for part in (step.d, step.y, step.zl, step.zu))
    assert abs(step.d[:2]).max() < 1e-12  # held there by multipliers that are not nothing


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

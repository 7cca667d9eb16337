"""The printed closed form (7.11) where it is legal: its signs, and the general subproblem beside it."""

import numpy as np
import pytest

from tests.papers.engine.closed_form import closed_form_update
from workbench.engine.layout.separable.dual import solve_subproblem
from workbench.engine.layout.separable.presets import OptimalityCriteria, Point


@pytest.mark.parametrize(
    ("objective", "priced", "expected"),
    [
        (-4.0, 1.0, 1.0),
        (1.0, 1.0, 0.1),
        (0.0, 1.0, 0.1),
        (-1.0, 0.0, 2.0),
        (-1.0, -1.0, 2.0),
        (0.0, 0.0, 0.5),
    ],
)
def test_the_sign_table_of_the_closed_form(objective, priced, expected):
    one = np.ones(1)
    new, refused = closed_form_update(
        0.5 * one, objective * one, priced * one, centre=0 * one, xi=-one, zeta=one, lower=0.1 * one,
        upper=2 * one,
    )  # fmt: skip
    assert new == [expected]
    assert not refused.any()


def test_the_closed_form_refuses_a_maximum():
    one = np.ones(1)
    new, refused = closed_form_update(
        0.5 * one, one, -one, centre=0 * one, xi=-one, zeta=one, lower=0 * one, upper=one
    )
    assert refused.all()
    assert new == [0.5]


@pytest.mark.parametrize("eta", [0.5, 0.75, 1.0])
def test_closed_form_and_general_subproblem_agree(eta):
    rng = np.random.default_rng(3)
    x, w, v = rng.uniform(0.2, 0.8, 40), rng.uniform(0.5, 2, 40), rng.uniform(0.5, 2, 40)
    model = OptimalityCriteria(eta=eta, move=0.3).model(
        [Point(x=x, values=np.array([1.0, 0.0]), gradients=np.vstack([-w, v]))], np.zeros(40), np.ones(40)
    )
    solution = solve_subproblem(model)
    new, _ = closed_form_update(
        x, -w, solution.multipliers[0] * v, centre=np.zeros(40), xi=np.full(40, 1 - 1 / eta),
        zeta=np.ones(40),
        lower=model.lower, upper=model.upper,
    )  # fmt: skip
    assert solution.x == pytest.approx(new, abs=1e-11)

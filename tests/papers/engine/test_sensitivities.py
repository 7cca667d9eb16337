"""Every method of chapters II, IV, V and VI against the exact discrete gradient (section numbers of the
dissertation)."""

import numpy as np
import pytest

from studies import three_body, two_body
from workbench.engine import NotSupported, gradient, gradient_check, simulate
from workbench.engine.sensitivity.gradient import METHODS

ROUNDING = 1e-12  # two algebras of the same scheme
ONE_NEWTON_STEP = 2e-9  # what one Newton step per time step leaves, plus the differences in dS/dalpha


@pytest.fixture(scope="module")
def runs():
    out = {}
    for name, p in (("A", two_body.problem("A")), ("C", two_body.problem("C")), ("D", three_body.problem())):
        run = simulate(p.system, p.density, p.t_end, 200)
        out[name] = p, run, gradient(p.system, p.density, run, p.objective)
    return out


def error(runs, case, method):
    p, run, exact = runs[case]
    found = gradient(p.system, p.density, run, p.objective, method)
    return np.linalg.norm(found - exact) / np.linalg.norm(exact), found @ exact / np.linalg.norm(
        found
    ) / np.linalg.norm(exact)


@pytest.mark.parametrize("case", ["A", "C", "D"])
def test_direct_differentiation_is_the_discrete_adjoint(runs, case):
    assert error(runs, case, "direct")[0] < ROUNDING


@pytest.mark.parametrize("case", ["A", "C", "D"])
def test_chapter_5_with_ds_is_the_discrete_gradient(runs, case):
    assert error(runs, case, "time_integration")[0] < ONE_NEWTON_STEP


@pytest.mark.parametrize(("case", "low", "high"), [("A", 5e-6, 2e-5), ("C", 2e-5, 1e-4), ("D", 3e-5, 1e-4)])
def test_chapter_5_without_ds_is_a_little_off(runs, case, low, high):
    assert low < error(runs, case, "time_integration_without_ds")[0] < high


@pytest.mark.parametrize(
    ("method", "case", "printed"),
    [
        ("adjoint", "C", 9e-5),
        ("iterative", "C", 2.3e-4),
        ("iterative", "D", 1.1e-4),
        ("iterative_printed", "C", 1.6e-2),
        ("iterative_printed", "D", 1.7e-2),
        ("iterative_truncated", "C", 1.6e-2),
    ],
)
def test_sizes_of_the_other_errors_at_200_steps(runs, method, case, printed):
    assert error(runs, case, method)[0] == pytest.approx(printed, rel=0.15)


def test_constant_load_points_the_wrong_way_when_the_maximum_is_at_the_end(runs):
    off, cosine = error(runs, "A", "constant_load")
    assert off == pytest.approx(2.2, rel=0.05)
    assert cosine == pytest.approx(-0.98, abs=0.005)
    off, cosine = error(runs, "C", "constant_load")
    assert off == pytest.approx(0.57, rel=0.05)
    assert cosine == pytest.approx(0.92, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "order"), [("iterative_printed", 1), ("iterative", 2), ("adjoint", 2)])
def test_orders_of_the_methods_of_chapter_6_and_of_the_continuous_adjoint(method, order):
    p = two_body.problem("C")
    steps, errors = np.array([100, 200, 400]), []
    for count in steps:
        run = simulate(p.system, p.density, p.t_end, int(count))
        exact = gradient(p.system, p.density, run, p.objective)
        found = gradient(p.system, p.density, run, p.objective, method)
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(order, abs=0.2)


def test_methods_that_cannot_hold_joints_say_so(runs):
    p, run, _ = runs["D"]
    for method in ("adjoint", "iterative_truncated"):
        with pytest.raises(NotSupported, match="joints; use"):
            gradient(p.system, p.density, run, p.objective, method)


def test_unknown_method_and_foreign_trajectories_are_refused(runs):
    p, run, _ = runs["A"]
    with pytest.raises(ValueError, match=f"method needs to be one of {', '.join(METHODS)}, got 'avm'"):
        gradient(p.system, p.density, run, p.objective, "avm")
    with pytest.raises(ValueError, match="belongs to another system"):
        gradient(runs["C"][0].system, p.density, run, p.objective)
    with pytest.raises(ValueError, match="computed with other densities"):
        gradient(p.system, p.density * 2, run, p.objective)


def test_gradient_check_prints_a_small_difference():
    p = three_body.problem()
    check = gradient_check(
        p.system, p.density, p.objective, t_end=0.2, steps=50, rng=np.random.default_rng(3)
    )
    assert check.relative_error < 1e-6
    assert str(check).startswith("gradient check: ")

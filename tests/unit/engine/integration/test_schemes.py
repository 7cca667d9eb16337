"""Order 8, BDF2 and user laws: values, exact gradients, and what each scheme refuses."""

from dataclasses import replace

import numpy as np
import pytest

from studies import three_body, two_body
from workbench.engine import (
    BDF2,
    Belt,
    Body,
    Bushing,
    Deviation,
    GeneralisedAlpha,
    IndependentAlpha,
    Maximum,
    Member,
    NotConverged,
    NotSupported,
    RevoluteJoint,
    RungeKutta8,
    Scalar,
    Spring,
    System,
    Terminal,
    UserLaw,
    VelocityVerlet,
    choose_scheme,
    convergence,
    gradient,
    locate_peak,
    parameter_gradient,
    simulate,
)

QUOTIENT = 5e-8  # fourth-order differences


@pytest.fixture(scope="module")
def truth():
    p = two_body.problem("C")
    run = locate_peak(simulate(p.system, p.density, p.t_end, 40, scheme=RungeKutta8()), p.objective)
    return p, run, gradient(p.system, p.density, run, p.objective)


def test_order_8_reaches_the_reference_value_and_time_of_the_peak(truth):
    p, run, _ = truth
    peak = p.objective.peaks(run)[0]
    assert peak.height == pytest.approx(76.164920995101, rel=1e-12)
    assert peak.time == pytest.approx(0.150394437474, abs=1e-11)


def test_gradients_against_continuous_truth(truth):
    p, _, exact = truth

    def error(run):
        return np.linalg.norm(gradient(p.system, p.density, run, p.objective) - exact) / np.linalg.norm(exact)

    assert error(simulate(p.system, p.density, p.t_end, 200)) < 5e-5
    assert error(simulate(p.system, p.density, p.t_end, 2000)) < 5e-7
    few = simulate(p.system, p.density, p.t_end, 12, scheme=RungeKutta8())
    assert error(locate_peak(few, p.objective)) < 1e-10
    # a peak kept to the nodes is wrong at first order
    node = replace(p.objective, refine=False)
    run = simulate(p.system, p.density, p.t_end, 200)
    coarse = gradient(p.system, p.density, run, node)
    assert np.linalg.norm(coarse - exact) / np.linalg.norm(exact) == pytest.approx(1.5e-2, rel=0.1)


@pytest.mark.parametrize(
    ("p", "scheme"),
    [
        (two_body.problem("C"), BDF2()),
        (three_body.problem(), BDF2()),
        (two_body.problem("C"), RungeKutta8()),
        (two_body.layout_problem("short", peak="refined"), VelocityVerlet()),
    ],
    ids=["BDF2", "BDF2 with a joint", "order 8", "Verlet"],
)
def test_gradients_of_the_other_schemes_are_their_own_differences(p, scheme):
    steps, e = 60, 1e-4
    d = np.random.default_rng(1).normal(size=len(p.density))
    d /= np.linalg.norm(d)
    g = {
        k: p.objective.value(simulate(p.system, p.density + k * e * d, p.t_end, steps, scheme=scheme))
        for k in (-2, -1, 1, 2)
    }
    run = simulate(p.system, p.density, p.t_end, steps, scheme=scheme)
    found = gradient(p.system, p.density, run, p.objective) @ d
    assert found == pytest.approx((8 * (g[1] - g[-1]) - (g[2] - g[-2])) / (12 * e), rel=QUOTIENT)


def test_a_user_law_that_is_a_spring_gives_the_springs_numbers():
    p = three_body.problem()
    own = UserLaw(force=lambda delta, rate, t, k: k * delta + 0.1 * rate, parameters={"k": 83.3})
    same = Spring(k=83.3, c=0.1)
    runs = []
    for law in (own, same):
        members = tuple(replace(m, law=law) if i % 2 else m for i, m in enumerate(p.system.members))
        system = replace(p.system, members=members)
        run = simulate(system, p.density, 0.2, 40)
        runs.append((run.position, gradient(system, p.density, run, p.objective)))
    np.testing.assert_allclose(runs[0][0], runs[1][0], atol=1e-13)
    np.testing.assert_allclose(runs[0][1], runs[1][1], rtol=1e-9, atol=1e-12 * np.abs(runs[1][1]).max())


def test_a_user_scalar_peak_comes_near_the_built_in_one():
    p = two_body.layout_problem("short", peak="refined")

    def g(t, q, v, w, density):
        c, s = np.cos(q[5]), np.sin(q[5])
        x, y = q[0] - q[3], q[1] - q[4]
        return (c * x + s * y) ** 2 + (c * y - s * x) ** 2

    run = simulate(p.system, p.density, p.t_end, p.steps)
    own, built_in = Maximum(quantity=Scalar(function=g)), p.objective
    assert own.value(run) == pytest.approx(built_in.value(run), rel=1e-6)
    a, b = (gradient(p.system, p.density, run, x) for x in (own, built_in))
    assert np.linalg.norm(a - b) / np.linalg.norm(b) < 1e-5


def free_mass(law=None, **kinds):
    mass = Body(name="mass", mass=1.0, inertia=1.0)
    member = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=law or Spring(k=10.0))
    return System(bodies=(mass,), members=(member,), **kinds)


def test_schemes_refuse_what_they_cannot_treat():
    p = three_body.problem()
    with pytest.raises(NotSupported, match="cannot hold joints"):
        simulate(p.system, p.density, 0.1, 10, scheme=VelocityVerlet())
    with pytest.raises(NotSupported, match="without joints; take more steps near the peak"):
        locate_peak(simulate(p.system, p.density, 0.1, 10, scheme=RungeKutta8()), p.objective)
    run = simulate(p.system, p.density, 0.1, 10, scheme=IndependentAlpha())
    for method in ("direct", "time_integration"):
        with pytest.raises(NotSupported, match="not IndependentAlpha"):
            gradient(p.system, p.density, run, p.objective, method=method)
    with pytest.raises(ValueError, match="independent alpha needs 0 <= rho <= 1, got rho=2"):
        IndependentAlpha(rho=2)
    free = simulate(free_mass(), [1.0], 0.1, 10, scheme=IndependentAlpha(rho=0.5))
    assert free.scheme == GeneralisedAlpha(rho=0.5)  # without joints every coordinate is independent
    pin = RevoluteJoint(a="mass", b="ground")
    jointed = free_mass(UserLaw(force=lambda delta, rate, t: 10.0 * delta), joints=(pin,))
    with pytest.raises(NotSupported, match="IndependentAlpha with joints runs the engine's own laws only"):
        simulate(jointed, [1.0], 0.1, 10, scheme=IndependentAlpha())
    grip = Bushing(a="mass", b="ground", k=1e3, slip=0.01, release=0.02)
    with pytest.raises(NotSupported, match="damage of bushings"):
        simulate(free_mass(bushings=(grip,)), [1.0], 0.1, 10, scheme=RungeKutta8())
    for scheme in (IndependentAlpha(), RungeKutta8()):
        with pytest.raises(NotSupported, match="damage of bushings"):
            simulate(free_mass(bushings=(grip,), joints=(pin,)), [1.0], 0.1, 10, scheme=scheme)
    with pytest.raises(NotSupported, match="breakable bushings, need GeneralisedAlpha"):
        simulate(free_mass(bushings=(grip,)), [1.0], 0.1, 10, scheme=BDF2())
    own = free_mass(UserLaw(force=lambda delta, rate, t: 10.0 * delta))
    with pytest.raises(NotSupported, match="own laws only"):
        simulate(own, [1.0], 0.1, 10, scheme=RungeKutta8())
    with pytest.raises(NotConverged, match=r"blew up before t = .* Take more steps"):
        simulate(free_mass(Spring(k=1e8)), [1.0], 10.0, 100, scheme=RungeKutta8())
    with pytest.raises(NotSupported, match="refined already"):
        locate_peak(simulate(free_mass(), [1.0], 0.1, 10), Maximum(quantity=Deviation(bodies=("mass",))))


def test_parameter_gradient_refuses_runs_it_cannot_differentiate():
    objective = Maximum(quantity=Deviation(bodies=("mass",)))
    own = free_mass(UserLaw(force=lambda delta, rate, t: 10.0 * delta))
    with pytest.raises(NotSupported, match=r"members\[0\] has a UserLaw. Take parameter_slopes\(\)"):
        parameter_gradient(simulate(own, [1.0], 0.1, 10), objective)


def test_choice_of_scheme_gives_its_reason():
    def reason(system, density=(1.0,), steps=100):
        choice = choose_scheme(system, np.array(density), t_end=1.0, steps=steps)
        return choice.scheme, choice.reason

    assert reason(free_mass()) == (RungeKutta8(), reason(free_mass())[1])
    assert "fastest mode" in reason(free_mass())[1]
    scheme, why = reason(free_mass(Spring(k=1e8)))
    assert scheme == GeneralisedAlpha()
    assert "too stiff" in why
    assert "kinks" in reason(free_mass(Belt()))[1]
    assert "user's law" in reason(free_mass(UserLaw(force=lambda delta, rate, t: delta)))[1]
    p = three_body.problem()
    assert "index-3" in choose_scheme(p.system, p.density, t_end=0.2, steps=100).reason


def test_convergence_says_how_many_steps_are_needed():
    objective = Terminal(quantity=Deviation(bodies=("mass",)))
    found = convergence(free_mass(), [1.0], objective, t_end=2.0, steps=20, tolerance=1e-6)
    truth = convergence(free_mass(), [1.0], objective, t_end=2.0, steps=2000)
    assert not found.fine_enough
    assert abs(found.value / truth.extrapolated - 1) == pytest.approx(found.relative_error, rel=0.1)
    assert "take about" in found.advice
    assert "fine enough" in truth.advice

"""Grids of unequal steps: refusals, equal ones as the run by their number, orders, exact gradients."""

import numpy as np
import pytest

from studies import three_body
from workbench.engine import (
    BDF2,
    Body,
    Bushing,
    ClipLevel,
    Coordinate,
    GeneralisedAlpha,
    HeadInjury,
    IndependentAlpha,
    Integral,
    Maximum,
    Member,
    NotSupported,
    PointAcceleration,
    RevoluteJoint,
    RungeKutta8,
    Spring,
    System,
    Terminal,
    UserLaw,
    gradient,
    simulate,
)
from workbench.engine.integration.grids import is_even, step_changes, step_lengths

ORDER = 0.1  # observed order less 2
QUOTIENT = 1e-7  # of differences of fourth order
END = Terminal(quantity=Coordinate(bodies=("bob",), direction=(1.0, 0.4)))


def in_turn(n, pattern, t_end=1.0):
    """n steps whose lengths repeat a pattern."""
    return t_end * np.append(0.0, np.cumsum(np.resize(pattern, n))) / np.resize(pattern, n).sum()


def gradual(n, t_end):
    """n steps that grow and shrink threefold, smoothly."""
    s = np.linspace(0.0, 1.0, n + 1)
    return t_end * (s - 0.5 * np.sin(2 * np.pi * s) / (2 * np.pi))


def at_random(seed, n, t_end=1.0):
    return in_turn(n, np.random.default_rng(seed).uniform(0.3, 2.0, n), t_end)


def swing(law=Spring, velocity=(0.3, -0.5, 1.0), **elements):
    """A bob on two springs that stretch by a third of their length."""
    bob = Body(name="bob", mass=2.0, inertia=0.1, position=(0.6, 0.1, 0.2), velocity=velocity)
    ties = tuple(
        Member(a="bob", b="ground", point_a=(0.1, y), point_b=(0.0, 4 * y), law=law(k=60.0, c=0.6))
        for y in (-0.2, 0.2)
    )
    return System(bodies=(bob,), members=ties, **elements)


def test_grids_that_do_not_grow_from_0_s_are_refused():
    for times, said in (
        ([0.0], "times needs at least two nodes in a row, got shape \\(1,\\)"),
        ([[0.0, 1.0]], "got shape \\(1, 2\\)"),
        ([0.0, np.nan, 1.0], "times needs finite values, got times\\[1\\]"),
        ([0.1, 0.2], "times needs to begin at 0 s, where the system starts, got 0.1 s"),
        ([0.0, 0.2, 0.2], "times needs growing values, got 0.2 s, then 0.2 s"),
    ):
        with pytest.raises(ValueError, match=said):
            simulate(swing(), [1.0, 1.0], times=times)
    with pytest.raises(ValueError, match="either times, or t_end and steps, got both"):
        simulate(swing(), [1.0, 1.0], 0.2, times=[0.0, 0.1])


def test_equal_steps_are_the_run_by_their_number_to_the_bit():
    for scheme in (GeneralisedAlpha(), RungeKutta8(), IndependentAlpha()):
        by_number = simulate(swing(), [1.0, 0.8], 0.7, 33, scheme=scheme)
        by_grid = simulate(swing(), [1.0, 0.8], times=np.linspace(0.0, 0.7, 34), scheme=scheme)
        assert np.array_equal(by_number.position, by_grid.position)
        assert np.array_equal(by_number.velocity, by_grid.velocity)
    rounded = np.arange(0.0, 0.7, 0.1)  # 0.1 + 0.2 is not 0.3
    assert is_even(rounded)
    assert len(set(step_lengths(rounded))) == 1
    assert not is_even(in_turn(5, (1, 1.001)))


def test_generalised_alpha_is_of_order_2_on_steps_that_change_all_the_time():
    true = simulate(swing(), [1.0, 0.8], 1.0, 200, scheme=RungeKutta8())
    for pattern in ((1, 3), (2, 1, 5, 3)):
        errors = []
        for n in (120, 240, 480):
            run = simulate(swing(), [1.0, 0.8], times=in_turn(n, pattern))
            errors.append([
                np.abs(getattr(run, part)[-1] - getattr(true, part)[-1]).max()
                for part in ("position", "velocity", "acceleration")
            ])  # fmt: skip
        order = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
        assert np.abs(order - 2.0).max() < ORDER


def test_order_8_goes_over_unequal_steps():
    true = simulate(swing(), [1.0, 0.8], 1.0, 200, scheme=RungeKutta8())
    run = simulate(swing(), [1.0, 0.8], times=at_random(0, 120), scheme=RungeKutta8())
    assert np.abs(run.position[-1] - true.position[-1]).max() < 1e-12


def test_with_joints_the_order_holds_on_gradual_grids_and_nothing_grows_on_others():
    p = three_body.problem()
    two, one = (simulate(p.system, p.density, p.t_end, n) for n in (1600, 800))
    parts = ("position", "velocity", "multiplier")
    true = {part: (4 * getattr(two, part)[-1] - getattr(one, part)[-1]) / 3 for part in parts}

    def errors(run):
        return np.array([np.abs(getattr(run, part)[-1] - true[part]).max() for part in parts])

    coarse, fine = (errors(simulate(p.system, p.density, times=gradual(n, p.t_end))) for n in (100, 200))
    assert np.abs(np.log2(coarse[:2] / fine[:2]) - 2.0).max() < ORDER
    assert 3.0 < coarse[2] / fine[2] < 6.0
    # steps that jump all the time are of order 1 with joints, as their page says; moved along they would grow
    coarse, fine = (
        errors(simulate(p.system, p.density, times=in_turn(n, (1, 3), p.t_end))) for n in (200, 400)
    )
    assert (fine < 0.75 * coarse).all()
    assert set(step_changes(in_turn(9, (1, 3)), joints=True)[1]) == {1.0}
    assert step_changes(np.array([0.0, 1.0, 2.1]), joints=True)[1, 2] == pytest.approx(1.1)


def pulled():
    """The bob in a grip that tears: a state of first order."""
    return swing(bushings=(Bushing(a="bob", b="ground", k=80.0, slip=0.05, release=0.4, tau=0.1),))


def pinned():
    """The bob on a pin, about which it turns."""
    x, y = 0.3 * np.sin(0.2), 0.3 * np.cos(0.2)
    pin = RevoluteJoint(a="bob", b="ground", point_a=(0.0, 0.3), point_b=(0.6 - x, 0.1 + y))
    return swing(velocity=(y, x, 1.0), joints=(pin,))


def written():
    """The bob on laws written in Python."""
    return swing(lambda k, c: UserLaw(force=lambda x, v, t: k * x + 50.0 * x**3 + c * v))


@pytest.mark.parametrize(
    ("make", "scheme"),
    [
        (swing, GeneralisedAlpha()), (swing, RungeKutta8()), (pulled, GeneralisedAlpha()),
        (pinned, GeneralisedAlpha(rho=0.7)), (pinned, RungeKutta8()), (written, GeneralisedAlpha()),
    ],
)  # fmt: skip
def test_gradients_are_exact_over_unequal_steps(make, scheme):
    given, times = np.array([1.0, 0.8]), at_random(3, 40, 0.6)
    system = make()
    run = simulate(system, given, times=times, scheme=scheme)
    if make is pulled:
        assert run.states[-1, 0] > 0.05
    for objective in (END, Integral(quantity=END.quantity)):
        found = gradient(system, given, run, objective)

        def value(x, objective=objective):
            return objective.value(simulate(system, x, times=times, scheme=scheme))

        for i, unit in enumerate(np.eye(2)):
            low, below, above, high = (value(given + k * 1e-3 * unit) for k in (-2, -1, 1, 2))
            slope = (8 * (above - below) - (high - low)) / 12e-3
            assert abs(found[i] - slope) < QUOTIENT * np.abs(found).max() + 1e-10


def test_a_peak_is_found_on_unequal_steps():
    objective = Maximum(quantity=END.quantity)
    true = objective.value(simulate(swing(), [1.0, 0.8], 1.0, 800, scheme=RungeKutta8()))
    assert objective.value(simulate(swing(), [1.0, 0.8], times=at_random(4, 800))) == pytest.approx(
        true, rel=1e-5
    )


def test_what_needs_equal_steps_says_so():
    times = at_random(1, 20)
    for scheme, who in ((BDF2(), "BDF2"), (IndependentAlpha(), "IndependentAlpha")):
        with pytest.raises(NotSupported, match=f"{who} needs steps of one length; run with steps="):
            simulate(pinned(), [1.0, 1.0], times=times, scheme=scheme)
    system = swing()
    run = simulate(system, [1.0, 1.0], times=times)
    pull = PointAcceleration(body="bob")
    for objective in (HeadInjury(quantity=pull), ClipLevel(quantity=pull)):
        with pytest.raises(NotSupported, match="an injury measure needs steps of one length"):
            objective.value(run)
    with pytest.raises(NotSupported, match="needs steps of one length"):
        gradient(system, [1.0, 1.0], run, END, method="direct")
    assert not run.goes_forward

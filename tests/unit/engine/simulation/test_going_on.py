"""Runs that go on from where another ended: the whole to the bit, and gradients with the start held."""

import numpy as np
import pytest

from studies import three_body
from tests.laws.engine.test_complex_step import small_system
from tests.unit.engine.integration.test_grids import END, gradual, pinned, pulled, swing, written
from tests.unit.engine.natural.test_runs import sprung
from workbench.engine import (
    BDF2,
    Coordinate,
    Deviation,
    GeneralisedAlpha,
    IndependentAlpha,
    NotSupported,
    PointCoordinate,
    RungeKutta8,
    Terminal,
    VelocityVerlet,
    gradient,
    parameter_slopes,
    simulate,
)

STATES = ("position", "velocity", "acceleration", "multiplier", "states")
QUOTIENT = 1e-7  # of differences of fourth order


THREE, SMALL, CLOSED = three_body.problem().system, small_system(), sprung()
CASES = {
    "springs": (swing(), GeneralisedAlpha(), 0.2),
    "springs, verlet": (swing(), VelocityVerlet(), 0.2),
    "springs, bdf2": (swing(), BDF2(), 0.2),
    "springs, order 8": (swing(), RungeKutta8(), 0.2),
    "damage": (pulled(), GeneralisedAlpha(), 0.2),
    "law in python": (written(), GeneralisedAlpha(), 0.2),
    "joint": (THREE, GeneralisedAlpha(), 0.1),
    "joint, bdf2": (THREE, BDF2(), 0.1),
    "slider, stops": (SMALL, GeneralisedAlpha(), 0.1),
    "slider, independent": (SMALL, IndependentAlpha(), 0.1),
    "slider, order 8": (SMALL, RungeKutta8(), 0.1),
    "natural": (CLOSED, IndependentAlpha(), 0.1),
    "natural, order 8": (CLOSED, RungeKutta8(), 0.1),
}


def same(whole, rest, first):
    for name in STATES:
        np.testing.assert_array_equal(getattr(rest, name), getattr(whole, name)[first:], err_msg=name)


@pytest.mark.parametrize("name", CASES)
def test_two_parts_are_the_whole_to_the_bit(name):
    system, scheme, t_end = CASES[name]
    density, times = np.full(len(system.members), 0.3), np.linspace(0.0, t_end, 31)
    whole = simulate(system, density, times=times, scheme=scheme)
    for seam in (1, 3, 16):
        part = simulate(system, density, times=times[: seam + 1], scheme=scheme)
        left = part.state()
        assert left.time == times[seam]
        np.testing.assert_array_equal(left.velocity, whole.velocity[seam])
        rest = simulate(system, density, times=times[seam:], scheme=scheme, start=left)
        same(whole, rest, seam)
        assert rest.step == whole.step
    # on from a run that went on itself, and from the middle of the whole
    middle = simulate(system, density, times=times[16:24], scheme=scheme, start=whole.state(16))
    same(whole, simulate(system, density, times=times[23:], scheme=scheme, start=middle.state()), 23)
    same(whole, simulate(system, density, times=times[20:], scheme=scheme, start=rest.state(4)), 20)


@pytest.mark.parametrize("system", [swing(), pulled(), THREE], ids=["springs", "damage", "joint"])
def test_unequal_steps_go_on_as_the_whole(system):
    density, times = np.full(len(system.members), 0.3), gradual(30, 0.2)
    whole = simulate(system, density, times=times)
    rest = simulate(system, density, times=times[12:], start=whole.state(12))
    same(whole, rest, 12)


def end_of(system):
    if system is CLOSED:
        return Terminal(quantity=PointCoordinate(point="P3", direction=(1.0, 0.5, -0.3)))
    if system in (THREE, SMALL):
        body = system.bodies[-1].name
        return Terminal(quantity=Coordinate(bodies=(body,), direction=(1.0, 0.4)))
    return END


@pytest.mark.parametrize("name", CASES)
def test_gradients_of_a_run_that_goes_on_hold_its_start(name):
    system, scheme, t_end = CASES[name]
    density, times = np.full(len(system.members), 0.3), np.linspace(0.0, t_end, 31)
    left = simulate(system, density, times=times[:11], scheme=scheme).state()

    def run(alpha):
        return simulate(system, alpha, times=times[10:], scheme=scheme, start=left)

    objective, rest = end_of(system), run(density)
    found = gradient(system, density, rest, objective)
    along = np.random.default_rng(4).normal(size=len(density))
    low, below, above, high = (objective.value(run(density + k * 1e-3 * along)) for k in (-2, -1, 1, 2))
    slope = (8 * (above - below) - (high - low)) / 12e-3
    assert abs(slope) > 0.0
    assert abs(found @ along - slope) < QUOTIENT * np.abs(found).max() * np.abs(along).sum()


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), BDF2(), RungeKutta8()], ids=repr)
def test_slopes_by_parameters_hold_the_start_too(scheme):
    times = np.linspace(0.0, 0.2, 31)

    def system(k):
        return swing(law=lambda **law: type(law_of)(k=k, c=law["c"]))

    law_of = swing().members[0].law
    left = simulate(system(60.0), [1.0, 0.8], times=times[:11], scheme=scheme).state()

    def value(k):
        return END.value(simulate(system(k), [1.0, 0.8], times=times[10:], scheme=scheme, start=left))

    ran = system(60.0)
    run = simulate(ran, [1.0, 0.8], times=times[10:], scheme=scheme, start=left)
    found = parameter_slopes(run, END, {"k": (60.0, system)})["k"]
    slope = (8 * (value(60.3) - value(59.7)) - (value(60.6) - value(59.4))) / 3.6
    assert found == pytest.approx(slope, rel=QUOTIENT)


def test_what_cannot_go_on_is_said():
    run = simulate(swing(), [1.0, 0.8], 0.1, 10)
    left = run.state()
    with pytest.raises(ValueError, match=r"start comes from a run of GeneralisedAlpha.*got BDF2"):
        simulate(swing(), [1.0, 0.8], 0.2, 10, scheme=BDF2(), start=left)
    with pytest.raises(ValueError, match=r"\(3, 3, 2, 0\) of them, got \(3, 3, 0, 0\)"):
        simulate(pinned(), [1.0, 0.8], 0.2, 10, start=left)
    with pytest.raises(ValueError, match=r"times needs to begin at 0\.1 s, where the start stands, got 0 s"):
        simulate(swing(), [1.0, 0.8], times=[0.0, 0.2], start=left)
    with pytest.raises(ValueError, match=r"needs t_end > 0\.1 s, got t_end=0\.1"):
        simulate(swing(), [1.0, 0.8], 0.1, 10, start=left)
    with pytest.raises(ValueError, match="go on from a start with steps or times"):
        simulate(swing(), [1.0, 0.8], 0.2, tolerance=1e-3, start=left)
    with pytest.raises(ValueError, match="node needs to be one of the run's 11, got 11"):
        run.state(11)
    with pytest.raises(ValueError, match="node 0 is the start of the system itself"):
        run.state(0)
    rest = simulate(swing(), [1.0, 0.8], 0.2, 10, start=left)
    assert rest.state(0) is left
    assert not rest.goes_forward
    with pytest.raises(NotSupported, match="begins at the start of a system, not at that of a run"):
        gradient(rest.system, [1.0, 0.8], rest, END, method="direct")
    backward = simulate(swing(), [1.0, 0.8], 0.1, 10, scheme=BDF2())
    with pytest.raises(NotSupported, match="steps of one length"):
        simulate(swing(), [1.0, 0.8], 0.2, 7, scheme=BDF2(), start=backward.state())


def test_a_deviation_of_a_run_that_goes_on_counts_from_its_own_first_node():
    run = simulate(swing(), [1.0, 0.8], 0.1, 10)
    rest = simulate(swing(), [1.0, 0.8], 0.2, 10, start=run.state())
    assert Deviation(bodies=("bob",)).values(rest)[0] == 0.0

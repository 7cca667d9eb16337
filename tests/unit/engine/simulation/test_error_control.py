"""A run to a tolerance in the plane: its error, the steps it takes, its gradient, what it refuses."""

import numpy as np
import pytest

from studies import three_body
from workbench.engine import (
    BDF2,
    Body,
    Bushing,
    Contact,
    Coordinate,
    GeneralisedAlpha,
    Member,
    NotConverged,
    NotSupported,
    RevoluteJoint,
    RungeKutta8,
    Spring,
    System,
    Terminal,
    gradient,
    simulate,
)
from workbench.engine.simulation.error_control import _gradual

CORNER = 1e-6  # the stop's law is C2: differences see its corner, 2e-6 at steps of 1e-3 and 1e-4
END = Terminal(quantity=Coordinate(bodies=("bob",), direction=(1.0, 0.4)))


def thrown(k=2e6, **elements):
    """A bob on a soft spring that meets a stiff stop within 1 s."""
    bob = Body(name="bob", mass=2.0, inertia=0.1, position=(0.6, 0.0, 0.0), velocity=(-4.0, 0.1, 0.5))
    return System(
        bodies=(bob,),
        members=(
            Member(a="bob", b="ground", point_b=(1.5, 0.1), law=Spring(k=40.0), natural_length=0.4),
            Member(a="bob", b="ground", law=Contact(k=k, side=-1, width=5e-4), natural_length=0.3),
        ),
        **elements,
    )


def off(system, density, run):
    """The largest error of its places, against order 8 over the same nodes and those between."""
    times = np.unique(
        np.concatenate([run.times, *(run.times[:-1] + s * np.diff(run.times) for s in (0.25, 0.5, 0.75))])
    )
    true = simulate(system, density, times=times, scheme=RungeKutta8())
    return float(np.abs(true.position[np.searchsorted(times, run.times)] - run.position).max())


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), GeneralisedAlpha(rho=0.5), RungeKutta8()])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_the_error_is_within_the_tolerance_and_not_far_below(scheme, tolerance):
    system, density = thrown(), [1.0, 1.0]
    run = simulate(system, density, t_end=1.0, scheme=scheme, tolerance=tolerance)
    assert run.times[-1] == 1.0
    assert "places are off by" in run.diagnosis.notices[-1]
    error = off(system, density, run)
    assert error < tolerance
    if isinstance(scheme, GeneralisedAlpha):
        assert error > tolerance / 10.0
        assert np.diff(run.times).min() < 0.1 * np.diff(run.times).max()  # short at the stop


def test_equal_steps_of_that_number_are_worse():
    system, density = thrown(), [1.0, 1.0]
    run = simulate(system, density, t_end=1.0, tolerance=1e-5)
    equal = simulate(system, density, 1.0, len(run.times) - 1)
    assert off(system, density, equal) > 5.0 * off(system, density, run)


def test_a_calm_motion_takes_the_fewest_steps_allowed():
    system = System(bodies=(Body(name="bob", mass=1.0, inertia=1.0, velocity=(1.0, 2.0, 0.3)),))
    run = simulate(system, [], t_end=1.0, steps=10, tolerance=1e-9)
    assert 18 <= len(run.times) - 1 <= 24  # and half again, to measure


def test_with_joints_neighbours_stay_alike_and_the_tolerance_holds():
    p = three_body.problem()
    run = simulate(p.system, p.density, p.t_end, tolerance=1e-7)
    ratio = np.diff(run.times)[1:] / np.diff(run.times)[:-1]
    assert ratio.max() < 1.2
    assert off(p.system, p.density, run) < 1e-7


def test_the_gradient_is_that_of_the_steps_taken():
    system, density = thrown(), np.array([1.0, 0.9])
    run = simulate(system, density, t_end=0.6, tolerance=1e-5)
    found = gradient(system, density, run, END)

    def value(x):
        return END.value(simulate(system, x, times=run.times))

    for i, unit in enumerate(np.eye(2)):
        low, below, above, high = (value(density + k * 1e-5 * unit) for k in (-2, -1, 1, 2))
        slope = (8 * (above - below) - (high - low)) / 12e-5
        assert abs(found[i] - slope) < CORNER * np.abs(found).max()


def test_gradual_grids_are_no_coarser_than_asked_and_change_slowly():
    rng = np.random.default_rng(2)
    times = np.append(0.0, np.cumsum(10.0 ** rng.uniform(-4, -1, 60)))
    found = _gradual(times)
    steps = np.diff(found)
    assert found[0] == 0.0
    assert found[-1] == times[-1]
    assert (steps > 0).all()
    for first, second, gap in zip(times[:-1], times[1:], np.diff(times), strict=True):
        inside = (found[:-1] < second) & (found[1:] > first)
        assert (steps[inside] <= gap * (1.0 + 1e-9)).all()
    ratio = steps[1:-2] / steps[:-3]  # the last two fill what is left
    assert ratio.max() < 1.2
    assert ratio.min() > 1.0 / 1.2


def test_what_cannot_be_held_is_refused():
    system, pair = thrown(), [1.0, 1.0]
    with pytest.raises(ValueError, match="either times or a tolerance, got both"):
        simulate(system, pair, times=[0.0, 0.1], tolerance=1e-3)
    for bad in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(ValueError, match="simulate needs tolerance > 0 m or rad"):
            simulate(system, pair, 0.1, tolerance=bad)
    with pytest.raises(NotConverged, match="40 steps do not keep the error within"):
        simulate(system, pair, 1.0, steps=5, tolerance=1e-8, most=40)
    with pytest.raises(
        NotSupported,
        match="GeneralisedAlpha and RungeKutta8, of planar systems and trees; got BDF2 of a System",
    ):
        simulate(system, pair, 0.1, tolerance=1e-3, scheme=BDF2())
    grip = Bushing(a="bob", b="ground", k=1e3, slip=0.01, release=0.02)
    with pytest.raises(NotSupported, match="does not carry states of force elements in the plane"):
        simulate(thrown(bushings=(grip,)), pair, 0.1, tolerance=1e-3)
    pin = RevoluteJoint(a="bob", b="ground", point_a=(0.0, 0.0), point_b=(0.6, 0.0))
    still = Body(name="bob", mass=2.0, inertia=0.1, position=(0.6, 0.0, 0.0))
    with pytest.raises(NotSupported, match=r"needs rho <= 0\.99 with joints, got 1\.0"):
        simulate(
            System(bodies=(still,), joints=(pin,)), [], 0.1, tolerance=1e-3, scheme=GeneralisedAlpha(rho=1.0)
        )

"""A kind of system from outside: the facade, the objectives and the sensitivities take it as it is."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from workbench.engine import (
    AtTime,
    Body,
    Coordinate,
    Deviation,
    Distance,
    GeneralisedAlpha,
    Maximum,
    Member,
    NaturalPoint,
    NaturalSystem,
    NotSupported,
    PointCoordinate,
    PointMember,
    Scalar,
    Slopes,
    Spring,
    StoredEnergy,
    System,
    Terminal,
    choose_steps,
    gradient,
    gradient_check,
    parameter_gradient,
    simulate,
)
from workbench.engine.integration.kinds import Widths
from workbench.engine.integration.outcome import Diagnosis, Status
from workbench.engine.simulation.simulate import KINDS

RATE = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Decay:
    """x' = -RATE alpha x, x(0) = 1: one state of first order, and no coordinates."""

    members: tuple = (SimpleNamespace(law=None, power=1.0, name=""),)
    size: int = 0
    in_python: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DecayRun:
    """Its exact solution at the nodes."""

    system: Decay
    density: np.ndarray
    scheme: GeneralisedAlpha
    times: np.ndarray
    diagnosis: Diagnosis
    status: Status = Status.COMPLETE

    @property
    def widths(self):
        return Widths(0, 0, 0, 0, 1)

    @property
    def states(self):
        return np.exp(-RATE * self.density[0] * self.times)[:, None]

    def adjoint(self, seeds):
        out = np.zeros((len(seeds.starts), 1))
        for (node, row), seed in zip(seeds.at, seeds.states, strict=True):
            out[row, 0] += seed[0] * -RATE * self.times[node] * self.states[node, 0]
        return out


def run(system, density, times, scheme):
    told = Diagnosis(newton_iterations=0, factorisations=0, redundant_rows=(), reason="exact")
    return DecayRun(system=system, density=density, scheme=scheme, times=times, diagnosis=told)


class Level:
    """x itself, with its rate."""

    has_rates = True

    def values(self, trajectory):
        return trajectory.states[:, 0]

    def rates(self, trajectory, nodes):
        return -RATE * trajectory.density[0] * trajectory.states[nodes, 0]

    def slopes(self, trajectory, node):
        return Slopes(states=np.ones(1))

    def rate_slopes(self, trajectory, node):
        explicit = -RATE * trajectory.states[node]
        return Slopes(states=-RATE * trajectory.density, density=explicit)


def test_a_kind_from_outside_plugs_in(monkeypatch):
    monkeypatch.setitem(KINDS, Decay, run)
    system, level = Decay(), Level()
    end = simulate(system, [0.5], 0.4, 20)
    assert gradient(system, [0.5], end, Terminal(quantity=level)) == pytest.approx(
        [-RATE * 0.4 * np.exp(-RATE * 0.5 * 0.4)]
    )
    between = AtTime(quantity=level, time=0.333)
    check = gradient_check(system, [0.5], between, t_end=0.4, steps=20, rng=np.random.default_rng(1))
    assert check.relative_error < 1e-9
    assert choose_steps(system, [0.5], between, t_end=0.4, steps=4, tolerance=1e-3).fine_enough


def test_an_unknown_kind_is_refused():
    with pytest.raises(TypeError, match=r"one of the kinds System, NaturalSystem.*got Decay"):
        simulate(Decay(), [0.5], 0.4, 20)


def oscillator():
    mass = Body(name="m", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    spring = Member(a="m", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))
    return System(bodies=(mass,), members=(spring,))


def pendulum():
    return NaturalSystem(
        points=(
            NaturalPoint(name="O", position=(0, 0, 0), fixed=True),
            NaturalPoint(name="P", position=(1, 0, 0), mass=1.0),
        ),
        conditions=(Distance(a="O", b="P"),),
        members=(PointMember(a="O", b="P", law=Spring(k=3.0)),),
    )


@pytest.mark.parametrize(
    ("system", "quantity"),
    [(oscillator(), StoredEnergy()), (pendulum(), PointCoordinate(point="P"))],
    ids=["planar", "natural"],
)
def test_a_trajectory_cannot_be_written(system, quantity):
    run = simulate(system, [1.0], 0.1, 10)
    for name in ("density", "times", "position", "velocity", "acceleration", "multiplier"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(run, name)[...] = 0.0
    before = run.position.copy()
    gradient(system, [1.0], run, Terminal(quantity=quantity))
    np.testing.assert_array_equal(run.position, before)


def test_what_natural_coordinates_cannot_give_is_refused_by_name():
    system = pendulum()
    run = simulate(system, [1.0], 0.1, 10)
    height = Maximum(quantity=PointCoordinate(point="P"))
    with pytest.raises(NotSupported, match="the iterative method is written for planar systems"):
        gradient(system, [1.0], run, height, method="iterative")
    with pytest.raises(NotSupported, match="natural coordinates take parameter_slopes"):
        parameter_gradient(run, height)
    with pytest.raises(NotSupported, match="StoredEnergy has values, but no rates"):
        gradient(system, [1.0], run, Terminal(quantity=StoredEnergy()))
    for quantity in (Coordinate(bodies=("P",)), Deviation(bodies=("P",))):
        with pytest.raises(NotSupported, match="PointCoordinate looks at them"):
            quantity.values(run)
    with pytest.raises(NotSupported, match="forward sensitivities are written for planar systems"):
        run.state_sensitivities(with_rates=False)
    assert not run.goes_forward


def test_the_ends_of_members_at_the_start():
    ends = pendulum().member_ends()
    assert (ends.body_a.tolist(), ends.body_b.tolist()) == ([0], [1])
    np.testing.assert_array_equal(ends.point_b, [[1.0, 0.0, 0.0]])
    ends = oscillator().member_ends()
    assert (ends.body_a.tolist(), ends.body_b.tolist()) == ([0], [1])
    np.testing.assert_array_equal(ends.point_b, [[-1.0, 0.0]])


def test_a_scalar_of_the_state_is_kind_blind():
    system = pendulum()
    run = simulate(system, [1.0], 0.1, 10)
    square = Terminal(quantity=Scalar(function=lambda t, q, v, w, density: q @ q))
    exact = Terminal(quantity=PointCoordinate(point="P", direction=(0.0, 0.0, 1.0)))
    assert gradient(system, [1.0], run, square) == pytest.approx([0.0], abs=1e-12)  # the length is kept
    assert gradient(system, [1.0], run, exact) == pytest.approx([0.0], abs=1e-12)

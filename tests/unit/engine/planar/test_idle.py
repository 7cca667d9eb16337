"""A run without the members of density zero is the run with them, and so are its gradients by all members."""

import numpy as np
import pytest

from workbench.engine import (
    Airbag,
    Belt,
    Body,
    Deviation,
    Maximum,
    Member,
    Motion,
    RevoluteJoint,
    System,
    simulate,
)
from workbench.engine.planar import runs
from workbench.engine.planar.compiled import acting_tables, compiled, on_grid
from workbench.engine.sensitivity.discrete_adjoint import discrete_adjoints

ROUNDING = 1e-9  # relative: sums in another order, over two hundred steps


def pendulum() -> System:
    """A rod on a moving car, held by belts and airbags."""
    car = Motion(
        position=lambda t: (-4.0 * t**2, 0.0, 0.0), velocity=lambda t: (-8.0 * t, 0.0, 0.0),
        acceleration=lambda t: (-8.0, 0.0, 0.0),
    )  # fmt: skip
    rod, wall = (
        Body(name="rod", mass=4.0, inertia=0.4, position=(0.0, 0.5, 0.0)),
        Body(name="car", motion=car),
    )
    members = tuple(
        Member(
            a="rod",
            b="car",
            point_a=(0.0, 0.4 - 0.1 * k),
            point_b=(side, 1.0 - 0.1 * k),
            law=law,
            power=power,
        )
        for k in range(4)
        for side, law, power in ((0.5, Belt(), 1.0), (-0.5, Airbag(), 2.0))
    )
    hinge = RevoluteJoint(a="rod", b="car", point_a=(0.0, -0.5), point_b=(0.0, 0.0))
    return System(bodies=(rod, wall), members=members, joints=(hinge,), gravity=(0.0, -9.81))


SOME = np.array([0.3, 0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0])
MOST = np.array([0.3, 0.1, 0.2, 0.4, 0.1, 0.2, 0.3, 0.0])
TILT = Maximum(quantity=Deviation(bodies=("rod",), reference="car"))


def test_a_run_and_its_gradients_are_those_with_every_member(monkeypatch: pytest.MonkeyPatch) -> None:
    system = pendulum()
    without = simulate(system, SOME, t_end=0.4, steps=200)
    slopes = discrete_adjoints(without, [TILT])
    monkeypatch.setattr(runs, "acting_tables", lambda tables: tables)
    everyone = simulate(system, SOME, t_end=0.4, steps=200)
    expected = discrete_adjoints(everyone, [TILT])
    np.testing.assert_allclose(without.position, everyone.position, rtol=ROUNDING, atol=1e-12)
    np.testing.assert_allclose(slopes, expected, rtol=ROUNDING, atol=ROUNDING * np.abs(expected).max())
    assert np.abs(expected[0, SOME == 0.0]).max() > 0.0  # members that are not there have slopes


def test_gradients_agree_with_differences_where_members_are_idle() -> None:
    system, h = pendulum(), 1e-6
    slopes = discrete_adjoints(simulate(system, SOME, t_end=0.4, steps=200), [TILT])[0]

    def value(density: np.ndarray) -> float:
        return float(TILT.value(simulate(system, density, t_end=0.4, steps=200)))

    for member in (0, 2, 3):  # one of them idle; powers of 1 and 2
        ahead = SOME + h * (np.arange(8) == member)
        assert (value(ahead) - value(SOME)) / h == pytest.approx(slopes[member], rel=1e-3)


def test_segments_keep_their_members() -> None:
    system = pendulum()
    tables = on_grid(compiled(system), SOME, np.linspace(0.0, 0.4, 3))
    few = acting_tables(tables)
    assert few.scale.tolist() == tables.scale[tables.scale > 0].tolist()
    assert len(few.segment) == len(tables.segment)
    for (_, _, first, last), (_, _, begin, end) in zip(tables.segment, few.segment, strict=True):
        own = tables.scale[first:last] > 0
        assert few.geometry[:, begin:end].tolist() == tables.geometry[:, first:last][:, own].tolist()
        assert few.law[:, begin:end].tolist() == tables.law[:, first:last][:, own].tolist()


def test_tables_of_which_most_members_act_are_left_alone() -> None:
    system = pendulum()
    tables = on_grid(compiled(system), MOST, np.linspace(0.0, 0.4, 3))
    assert acting_tables(tables) is tables


def test_functions_of_time_are_sampled_once_per_grid() -> None:
    asked: list[float] = []

    def place(t: float) -> tuple[float, float, float]:
        asked.append(t)
        return (t, 0.0, 0.0)

    moved = Body(name="car", motion=Motion(position=place, velocity=lambda t: (1.0, 0.0, 0.0)))
    system = System(bodies=(Body(name="ball"), moved))
    parts = compiled(system)
    asked.clear()
    coarse, fine = np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 5)
    for _ in range(2):
        first = on_grid(parts, np.zeros(0), coarse)
    assert len(asked) == 3
    second = on_grid(parts, np.zeros(0), fine)
    assert len(asked) == 8
    assert first.motion[:, 0, 0].tolist() == coarse.tolist()
    assert second.motion[:, 0, 0].tolist() == fine.tolist()

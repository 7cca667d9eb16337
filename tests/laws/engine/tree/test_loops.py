"""Closed loops: the same motion in other engines, the order of the scheme, and exact gradients."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.sample_loops import bricard_tree, four_bar, wishbone
from workbench.engine import (
    Body,
    Coordinate,
    CutJoint,
    GeneralisedAlpha,
    Revolute,
    RevoluteJoint,
    RungeKutta8,
    SpatialBody,
    Spring,
    System,
    Terminal,
    TreeSystem,
    close_loops,
    gradient,
    parameter_gradient,
    parameter_slopes,
    simulate,
)
from workbench.engine.tree.loops.histories import cut_gaps

EXACT = 1e-8  # of the largest slope; the differences reach about 1e-9
DENSITY = np.array([0.7, 0.9])
SCHEME = GeneralisedAlpha(rho=0.8)


def planar_twin(tree):
    """The four-bar in absolute coordinates of the plane x, z, at the same start."""
    first = simulate(tree, [], t_end=1e-3, steps=1)
    bodies, half = [], []
    for body in tree.bodies:
        frame = first.frames(body.name, [0])
        arm = frame.axes[0] @ np.asarray(body.centre)
        place, speed = frame.origin[0] + arm, frame.velocity[0] + np.cross(frame.spin[0], arm)
        turn = float(np.arctan2(frame.axes[0, 2, 0], frame.axes[0, 0, 0]))
        bodies.append(
            Body(
                name=body.name, mass=body.mass, inertia=body.inertia[1], position=(place[0], place[2], turn),
                velocity=(speed[0], speed[2], -frame.spin[0, 1]),
            )
        )  # fmt: skip
        half.append(body.centre[0])
    a, b, c = half
    return System(
        bodies=tuple(bodies), gravity=(0.0, -9.81),
        joints=(
            RevoluteJoint(a="crank", b="ground", point_a=(-a, 0.0), point_b=(0.0, 0.0)),
            RevoluteJoint(a="coupler", b="crank", point_a=(-b, 0.0), point_b=(a, 0.0)),
            RevoluteJoint(a="rocker", b="ground", point_a=(-c, 0.0), point_b=(1.0, 0.0)),
            RevoluteJoint(a="coupler", b="rocker", point_a=(b, 0.0), point_b=(c, 0.0)),
        ),
    )  # fmt: skip


@pytest.mark.slow
def test_a_four_bar_moves_as_in_the_plane_with_order_two():
    """Two extrapolations of the order-2 scheme meet order 8 of the planar engine."""
    tree = four_bar(springs=False)
    exact = simulate(planar_twin(tree), [], t_end=1.0, steps=400, scheme=RungeKutta8()).of("coupler")[-1, :2]
    found, energies = [], []
    for steps in (800, 1600, 3200):
        run = simulate(tree, [], t_end=1.0, steps=steps, scheme=SCHEME)
        found.append(run.of("coupler", (0.5, 0.0, 0.0))[-1, [0, 2]])
        energy = run.kinetic_energy() + run.gravity_energy()
        energies.append(np.abs(energy - energy[0]).max())
        assert np.abs(cut_gaps(run)).max() < 1e-13
        assert len(run.diagnosis.redundant_rows) == 3  # a plane loop in space
    errors = [np.linalg.norm(x - exact) for x in found]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)
    assert np.log2(energies[1] / energies[2]) == pytest.approx(2.0, abs=0.05)
    once = [(4.0 * fine - coarse) / 3.0 for coarse, fine in pairwise(found)]
    assert (8.0 * once[1] - once[0]) / 7.0 == pytest.approx(exact, abs=1e-10)


@pytest.mark.slow
def test_a_cylindrical_cut_moves_a_plane_loop_as_a_revolute_one():
    runs = [
        simulate(four_bar(kind=kind), DENSITY, t_end=0.4, steps=40) for kind in ("revolute", "cylindrical")
    ]
    np.testing.assert_allclose(runs[0].position, runs[1].position, atol=1e-10)


@pytest.mark.slow
def test_a_universal_cut_turns_two_shafts_as_hookes_joint_does():
    """tan b = tan a/cos(angle) between the shafts; their common energy stays."""
    angle, inertia = 0.5, (0.02, 0.03, 0.04)
    tilted = (float(np.cos(angle)), float(np.sin(angle)), 0.0)
    shafts = (
        SpatialBody(name="a", joint=Revolute(axis=(1.0, 0.0, 0.0), speed=9.0), mass=1.0, inertia=inertia),
        SpatialBody(name="b", joint=Revolute(axis=tilted, speed=9.0), mass=1.0, inertia=inertia),
    )
    cross = CutJoint(a="a", b="b", kind="universal", axis_a=(0.0, 1.0, 0.0), axis_b=(0.0, 0.0, 1.0))
    system = close_loops(TreeSystem(bodies=shafts, cuts=(cross,)), held=(("a", 0),))
    run = simulate(system, [], t_end=1.0, steps=2000)
    a, b = run.position.T
    np.testing.assert_allclose(np.sin(a) * np.cos(b), np.cos(angle) * np.cos(a) * np.sin(b), atol=1e-12)
    ratio = np.cos(angle) / (np.cos(angle) ** 2 * np.cos(a) ** 2 + np.sin(a) ** 2)
    assert np.ptp(ratio) > 0.2
    np.testing.assert_allclose(run.velocity[:, 1], ratio * run.velocity[:, 0], rtol=2e-4)
    energy = run.kinetic_energy()
    np.testing.assert_allclose(energy, energy[0], rtol=2e-4)


def test_bricards_mechanism_with_its_redundant_condition():
    """Against another code at whole seconds, good to about 2e-7 (see tests/papers)."""
    others = [(0.5105015, -1.6491676, 0.1401231), (-0.9693403, -1.2212469, 0.7542780)]
    coarse, fine = (
        simulate(bricard_tree(), [], 2.0, steps, scheme=GeneralisedAlpha(rho=0.9)).of("rod3")[:: steps // 2]
        for steps in (500, 1000)
    )
    np.testing.assert_allclose(((4.0 * fine - coarse) / 3.0)[1:], others, atol=1e-6)


def differences(value, step):
    """Fourth-order central differences about zero."""
    return (8.0 * (value(step) - value(-step)) - (value(2 * step) - value(-2 * step))) / (12.0 * step)


@pytest.mark.slow
def test_gradients_by_densities_numbers_and_places_of_the_cut_joint():
    """Each against repeated runs, starts closed again where a loop changes."""
    objective = Terminal(quantity=Coordinate(bodies=("coupler",), direction=(0.3, 0.1, 1.0)))
    system = four_bar()

    def value(changed, density=DENSITY):
        return objective.value(simulate(changed, density, t_end=0.4, steps=20, scheme=SCHEME))

    run = simulate(system, DENSITY, t_end=0.4, steps=20, scheme=SCHEME)
    by_density = gradient(system, DENSITY, run, objective)
    slopes = parameter_gradient(run, objective)

    def stiffer(x):
        first = replace(system.members[0], law=Spring(k=30.0 + x, c=1.0))
        return replace(system, members=(first, *system.members[1:]))

    def heavier(x):
        crank, coupler, rocker = system.bodies
        return replace(system, bodies=(crank, replace(coupler, mass=2.0 + x), rocker))

    def nearer(x):
        return replace(system, cuts=(replace(system.cuts[0], point_a=(1.0 + x, 0.0, 0.0)),))

    def longer(x):
        return four_bar(tip=1.0 + x)

    def faster(x):
        return four_bar(speed=2.0 + x)

    changes = {"nearer": (0.0, nearer), "longer": (0.0, longer), "faster": (0.0, faster)}
    moved = parameter_slopes(run, objective, changes)
    found = [*by_density, slopes.law[0, 0], slopes.mass[1], *moved.values()]
    checked = [
        *(differences(lambda x, e=e: value(system, DENSITY + x * e), 1e-2) for e in np.eye(2)),
        differences(lambda x: value(stiffer(x)), 0.3),
        differences(lambda x: value(heavier(x)), 0.02),
        *(differences(lambda x, make=make: value(make(x)), 1e-3) for _, make in changes.values()),
    ]
    np.testing.assert_allclose(found, checked, atol=EXACT * np.abs(checked).max())
    assert np.abs(checked).min() > 1e-3


@pytest.mark.slow
def test_a_suspended_wishbone_by_ball_and_rod():
    """One way to move of five; no drift, and slopes by the place of the tie rod and the strut's rate."""
    objective = Terminal(quantity=Coordinate(bodies=("carrier",), direction=(1.0, 0.5, 0.2)))

    def run(system):
        return simulate(system, [1.0], t_end=0.2, steps=40, scheme=SCHEME)

    def moved(x):
        return close_loops(wishbone(rod=(0.1, 0.35, 0.02 + x)), held=(("lower", 0),))

    def stiffer(x):
        return close_loops(wishbone(stiffness=2e4 + x), held=(("lower", 0),))

    base = run(moved(0.0))
    assert base.multiplier.shape == (41, 4)
    assert base.diagnosis.redundant_rows == ()
    assert np.abs(cut_gaps(base)).max() < 1e-13
    slopes = parameter_slopes(base, objective, {"rod": (0.0, moved)})
    stiffness = parameter_gradient(base, objective).law[0, 0]
    found = [slopes["rod"], 1e4 * stiffness]
    checked = [
        differences(lambda x: objective.value(run(moved(x))), 1e-3),
        1e4 * differences(lambda x: objective.value(run(stiffer(x))), 100.0),
    ]
    np.testing.assert_allclose(found, checked, atol=EXACT * np.abs(checked).max())
    rod = base.cut_force("tie rod")
    along = base.of("carrier", (0.12, -0.02, 0.05)) - (0.1, 0.35, 0.02)
    assert np.abs(np.cross(rod.force, along)).max() < 1e-9 * np.abs(rod.force).max()

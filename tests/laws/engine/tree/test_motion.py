"""What every motion of a tree obeys: momenta in free fall, order two, no trace of the order of
declaration."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_trees import random_bodies, random_tree, tree_run
from workbench.engine.integration.schemes import GeneralisedAlpha, RungeKutta8
from workbench.engine.tree.joints import Floating, Revolute, Spherical
from workbench.engine.tree.system import SpatialBody, TreeSystem

# Arnold, Bruels & Cardona's heavy top at 0.2 s, unit quaternion, from independent integrations to 8 digits
HEAVY_TOP = (-0.70827915, 0.43878109, 0.54572840, 0.08939975)


def heavy_top():
    return TreeSystem(
        bodies=(
            SpatialBody(
                name="top", joint=Spherical(spin=(0.0, 150.0, -4.61538)), mass=15.0, centre=(0.0, 1.0, 0.0),
                inertia=(0.234375, 0.46875, 0.234375),
            ),
        )
    )  # fmt: skip


def test_the_heavy_top_arrives_with_order_two():
    scheme = GeneralisedAlpha(rho=0.9)
    runs = [
        tree_run(heavy_top(), np.zeros(0), np.linspace(0.0, 0.2, n + 1), scheme, keep=False)
        for n in (500, 1000, 2000)
    ]
    q = np.array([run.position[-1] for run in runs])
    errors = np.linalg.norm(q - np.array(HEAVY_TOP), axis=1)
    order = np.log2(errors[:-1] / errors[1:])
    assert order == pytest.approx(2.0, abs=0.05)
    best = (4.0 * q[2] - q[1]) / 3.0  # Richardson
    assert best == pytest.approx(np.array(HEAVY_TOP), abs=2e-6)
    assert np.linalg.norm(q, axis=1) == pytest.approx(1.0, abs=1e-13)


def test_momenta_of_a_falling_tree():
    """Angular momentum about the global origin and linear momentum of bodies in free fall; energy."""
    rng = np.random.default_rng(5)
    bodies = random_bodies(9, rng, first=0)
    system = TreeSystem(bodies=bodies, gravity=(0.0, 0.0, 0.0))
    errors = []
    for steps in (400, 800):
        run = tree_run(system, np.zeros(0), np.linspace(0.0, 0.4, steps + 1), keep=False)
        moved = run.momentum() - run.momentum()[0]
        errors.append([np.abs(moved).max(), np.abs(np.ptp(run.kinetic_energy()))])
    order = np.log2(np.array(errors[0]) / errors[1])
    assert (order > 1.9).all()
    run = tree_run(replace(system, gravity=(0.0, 0.0, -9.81)), np.zeros(0), np.linspace(0.0, 0.1, 101))
    mass = sum(body.mass for body in bodies)
    force = np.gradient(run.momentum()[:, 5], run.times)[5:-5]
    assert force == pytest.approx(-9.81 * mass, rel=1e-3)


def test_energy_of_a_swinging_chain_converges():
    """Kinetic and gravity energy of a chain of revolute and spherical joints: drift of second order."""
    links = tuple(
        SpatialBody(
            name=f"link{i}", parent=f"link{i - 1}" if i else "ground",
            joint=Spherical(spin=(1.0, 2.0, 0.5)) if i % 2 else Revolute(axis=(0.0, 1.0, 0.0), speed=2.0),
            at=(0.3, 0.0, 0.0) if i else (0.0, 0.0, 0.0), mass=1.0, centre=(0.15, 0.0, 0.01),
            inertia=(0.01, 0.02, 0.03),
        )
        for i in range(4)
    )  # fmt: skip
    drift = []
    for steps in (400, 800):
        run = tree_run(
            TreeSystem(bodies=links), np.zeros(0), np.linspace(0.0, 1.0, steps + 1),
            GeneralisedAlpha(rho=1.0), keep=False,
        )  # fmt: skip
        energy = run.kinetic_energy() + run.gravity_energy()
        drift.append(np.abs(energy - energy[0]).max())
    assert np.log2(drift[0] / drift[1]) == pytest.approx(2.0, abs=0.1)


def test_the_order_of_declaration_leaves_no_trace():
    rng = np.random.default_rng(3)
    system = random_tree(rng, count=7)
    shuffled = replace(system, bodies=tuple(rng.permutation(np.array(system.bodies, object))))
    times, density = np.linspace(0.0, 0.1, 21), np.full(12, 0.5)
    one, two = (tree_run(s, density, times, keep=False) for s in (system, shuffled))
    for body in system.bodies:
        assert np.array_equal(one.of(body.name, (0.1, 0.2, 0.3)), two.of(body.name, (0.1, 0.2, 0.3)))


def test_several_trees_fall_alike():
    """Two trees in one system move as each alone."""
    ball = SpatialBody(
        name="ball", joint=Floating(velocity=(1.0, 0.0, 2.0)), mass=2.0, inertia=(1.0, 2.0, 3.0)
    )
    times = np.linspace(0.0, 0.5, 51)
    alone = tree_run(TreeSystem(bodies=(ball,)), np.zeros(0), times)
    both = tree_run(TreeSystem(bodies=(ball, *heavy_top().bodies)), np.zeros(0), times)
    assert both.of("ball") == pytest.approx(alone.of("ball"), abs=1e-12)
    closed = np.outer(times, (1.0, 0.0, 2.0)) + np.outer(times**2, (0.0, 0.0, -4.905))
    assert alone.of("ball") == pytest.approx(closed, abs=1e-10)


def falling_figure():
    """Seventeen bodies on balls and hinges, thrown."""
    rng = np.random.default_rng(17)
    bodies = [
        SpatialBody(
            name="b0", joint=Floating(velocity=(1.0, 0.5, 3.0), spin=(0.5, 1.0, 2.0)), mass=10.0,
            inertia=(0.3, 0.2, 0.1),
        )
    ]  # fmt: skip
    for i in range(1, 17):
        ball = Spherical(spin=tuple(rng.normal(size=3)))
        bodies.append(
            SpatialBody(
                name=f"b{i}", parent=f"b{(i - 1) // 2}",
                joint=ball if i % 2 else Revolute(axis=(0, 1, 0), speed=1.0),
                at=tuple(0.3 * rng.normal(size=3)), mass=float(rng.uniform(0.5, 3.0)),
                centre=tuple(0.1 * rng.normal(size=3)), inertia=(0.02, 0.03, 0.04),
            )
        )  # fmt: skip
    return TreeSystem(bodies=tuple(bodies), gravity=(0.0, 0.0, 0.0))


@pytest.mark.slow
def test_a_figure_in_free_fall_keeps_its_momenta_and_energy_with_order_8():
    run = tree_run(falling_figure(), np.zeros(0), np.linspace(0.0, 2.0, 401), RungeKutta8())
    moved = run.momentum() - run.momentum()[0]
    assert np.abs(moved).max() < 1e-10 * np.abs(run.momentum()).max()
    energy = run.kinetic_energy()
    assert np.ptp(energy) < 1e-9 * energy[0]


def test_the_explicit_scheme_has_order_8():
    exact = tree_run(heavy_top(), np.zeros(0), np.linspace(0.0, 0.2, 801), RungeKutta8()).position[-1]
    errors = [
        np.abs(
            tree_run(heavy_top(), np.zeros(0), np.linspace(0.0, 0.2, n + 1), RungeKutta8()).position[-1]
            - exact
        ).max()
        for n in (40, 60, 90)
    ]
    order = np.log(np.array(errors[:-1]) / errors[1:]) / np.log(1.5)
    assert (order > 7.5).all()
    assert exact == pytest.approx(np.array(HEAVY_TOP), abs=1e-8)

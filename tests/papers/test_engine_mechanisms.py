"""Mechanisms of the IFToMM library and of the IVP test set, energy, orders and spectral radii of the
integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from workbench.engine import (
    BDF2,
    Body,
    Coordinate,
    DistanceJoint,
    GeneralisedAlpha,
    Load,
    Member,
    RevoluteJoint,
    Spring,
    System,
    Terminal,
    simulate,
)

ORDER = 0.05  # successive differences at 800 to 3200 steps still hold a little of the next order


def rod(name, start, end, mass=1.0, velocity=(0.0, 0.0, 0.0)):
    """A uniform rod from start to end; its ends are (-L/2, 0) and (L/2, 0) in its frame."""
    start, end = np.array(start), np.array(end)
    d = end - start
    length = float(np.hypot(*d))
    place = (*(0.5 * (start + end)), float(np.arctan2(d[1], d[0])))
    return Body(
        name=name, mass=mass, inertia=mass * length**2 / 12, position=place, velocity=velocity
    ), length


def pendulum():
    mass = Body(name="m", mass=1.0, inertia=1e-3, position=(-1.0, 0.0, 0.0))
    return System(bodies=(mass,), joints=(DistanceJoint(a="m", b="ground"),))


def four_bars(windows):
    """IFToMM A02: vertical bars upright, vx of the first coupler pin 1 m/s, 9.81 m/s^2."""
    bodies, joints = [], []
    for i in range(windows + 1):
        bar, _ = rod(f"bar{i}", (float(i), 0.0), (float(i), 1.0), velocity=(0.5, 0.0, -1.0))
        bodies.append(bar)
        joints.append(RevoluteJoint(a=f"bar{i}", b="ground", point_a=(-0.5, 0.0), point_b=(float(i), 0.0)))
    for i in range(windows):
        link, _ = rod(f"link{i}", (float(i), 1.0), (i + 1.0, 1.0), velocity=(1.0, 0.0, 0.0))
        bodies.append(link)
        joints.append(RevoluteJoint(a=f"link{i}", b=f"bar{i}", point_a=(-0.5, 0.0), point_b=(0.5, 0.0)))
        joints.append(RevoluteJoint(a=f"link{i}", b=f"bar{i + 1}", point_a=(0.5, 0.0), point_b=(0.5, 0.0)))
    return System(bodies=bodies, joints=joints, gravity=(0.0, -9.81))


def pin(run):
    """Position of the first coupler pin."""
    q = run.of("bar0")
    return q[:, :2] + 0.5 * np.stack([np.cos(q[:, 2]), np.sin(q[:, 2])], axis=1)


def test_pendulum_over_ten_seconds():
    # A01: m = L = 1, horizontal start at rest, g = 9.8; the swing angle from an independent ODE
    exact = solve_ivp(lambda t, y: [y[1], -9.8 * np.cos(y[0])], (0, 10), [np.pi, 0.0], rtol=1e-12, atol=1e-12)
    end = np.array([np.cos(exact.y[0, -1]), np.sin(exact.y[0, -1])])
    coarse, fine = (
        simulate(pendulum(), [], 10.0, steps, scheme=GeneralisedAlpha(rho=0.9)).position[-1, :2]
        for steps in (4000, 8000)
    )
    assert np.abs((4 * fine - coarse) / 3 - end).max() < 1e-6
    assert np.abs(coarse - end).max() < 1e-3


@pytest.mark.slow
def test_two_windows_over_ten_seconds_end_where_minimal_coordinates_do():
    coarse, fine = (
        simulate(four_bars(2), [], 10.0, steps, scheme=GeneralisedAlpha(rho=0.95)) for steps in (5000, 10000)
    )
    end = (4 * pin(fine)[-1] - pin(coarse)[-1]) / 3
    np.testing.assert_allclose(end, (0.328458112, 0.944518538), atol=1e-6)
    energy = fine.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1.2e-3  # J at h = 1e-3; an independent code has 1.1e-3
    wide = coarse.mechanical_energy()
    assert np.abs(wide - wide[0]).max() / np.abs(energy - energy[0]).max() == pytest.approx(4.0, rel=0.1)
    assert np.abs(fine.joint_residuals()).max() < 1e-12


def test_a_redundant_bar_is_named_and_does_no_harm():
    # parallel cranks: a second coupler between the same bars says nothing new
    plain = four_bars(1)
    extra, _ = rod("extra", (0.0, 0.5), (1.0, 0.5), mass=1.0, velocity=(0.5, 0.0, 0.0))
    doubled = System(
        bodies=(*plain.bodies, extra),
        joints=(
            *plain.joints,
            RevoluteJoint(a="extra", b="bar0", point_a=(-0.5, 0.0), point_b=(0.0, 0.0)),
            RevoluteJoint(a="extra", b="bar1", point_a=(0.5, 0.0), point_b=(0.0, 0.0), name="one too many"),
        ),
        gravity=plain.gravity,
    )
    run = simulate(doubled, [], 0.5, 1000, scheme=GeneralisedAlpha(rho=0.9))
    assert run.diagnosis.redundant_rows == ("one too many, row 0",)
    assert np.abs(run.joint_residuals()).max() < 1e-11
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-4


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 0.9, 1.0])
def test_spectral_radius_far_above_the_step(rho):
    # omega h = 1e4 on q'' + omega^2 q = 0: the amplification matrix of (q, h v, h^2 a, h^2 w)
    am, af, gamma, beta = GeneralisedAlpha(rho=rho).numbers
    z = 1e8
    c = (1 - af) / (1 - am)
    columns = []
    for unit in np.eye(4):
        q, v, a, w = unit
        base = (af * w - am * a) / (1 - am)
        known = q + v + (0.5 - beta) * a + beta * base
        w1 = -z * known / (1 + beta * c * z)
        a1 = base + c * w1
        columns.append([q + v + (0.5 - beta) * a + beta * a1, v + (1 - gamma) * a + gamma * a1, a1, w1])
    radius = np.abs(np.linalg.eigvals(np.array(columns).T)).max()
    assert radius == pytest.approx(rho, abs=3e-3)


def swing():
    """A jointed, sprung system with a smooth motion: pendulum bar on a pin, spring to the ground."""
    bar, _ = rod("bar", (0.0, 0.0), (1.0, 0.0))
    return System(
        bodies=(bar,),
        joints=(RevoluteJoint(a="bar", b="ground", point_a=(-0.5, 0.0)),),
        members=(
            Member(a="bar", b="ground", point_a=(0.5, 0.0), point_b=(1.0, 1.0), law=Spring(k=40.0, c=0.5)),
        ),
        loads=(Load(body="bar", torque=lambda t: np.sin(3 * t)),),
    )


@pytest.mark.parametrize(
    "scheme",
    [GeneralisedAlpha(rho=0.5), GeneralisedAlpha(rho=0.8), GeneralisedAlpha(rho=0.95), BDF2()],
    ids=["rho 0.5", "rho 0.8", "rho 0.95", "BDF2"],
)
def test_second_order_in_positions_velocities_and_joint_forces(scheme):
    runs = [simulate(swing(), [1.0], 1.0, n, scheme=scheme) for n in (800, 1600, 3200)]
    for name in ("position", "velocity", "multiplier"):
        ends = [getattr(run, name)[-1] for run in runs]
        order = np.log2(np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm(ends[2] - ends[1]))
        # BDF2's single first-order starting step fades slowly from the velocities
        slack = 0.15 if isinstance(scheme, BDF2) else ORDER
        assert order == pytest.approx(2.0, abs=slack), name


def test_a_driven_quantity_reads_the_ground_frame():
    run = simulate(swing(), [1.0], 0.1, 50)
    objective = Terminal(quantity=Coordinate(bodies=("bar",), direction=(1.0, 0.0)))
    assert objective.value(run) == pytest.approx(run.position[-1, 0])

"""Mechanisms of the IFToMM library and of the IVP test set, energy, orders and spectral radii of the
integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from workbench.engine import (
    BDF2,
    AssemblyError,
    Body,
    Coordinate,
    DistanceJoint,
    GeneralisedAlpha,
    IndependentAlpha,
    Load,
    Member,
    NotConverged,
    RevoluteJoint,
    RungeKutta8,
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
        simulate(four_bars(2), [], 10.0, steps, scheme=GeneralisedAlpha(rho=0.99)) for steps in (5000, 10000)
    )
    end = (4 * pin(fine)[-1] - pin(coarse)[-1]) / 3
    np.testing.assert_allclose(end, (0.328458112, 0.944518538), atol=1e-6)
    energy = fine.mechanical_energy()
    # within a turn the error swings with the step squared, J at h = 1e-3; over the turns nothing drifts
    assert np.abs(energy - energy[0]).max() < 1.2e-3  # an independent code has 1.1e-3
    fifths = [part.mean() for part in np.array_split(energy, 5)]
    assert np.ptp(fifths) < 1.5e-4
    assert abs(energy[-1] - energy[0]) < 1.5e-4
    wide = coarse.mechanical_energy()
    assert np.abs(wide - wide[0]).max() / np.abs(energy - energy[0]).max() == pytest.approx(4.0, rel=0.1)
    assert np.abs(fine.joint_residuals()).max() < 1e-12


@pytest.mark.slow
def test_pendulum_undamped_over_ten_seconds():
    exact = solve_ivp(
        lambda t, y: [y[1], -9.8 * np.cos(y[0])],
        (0, 10),
        [np.pi, 0.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
    )
    end = np.array([np.cos(exact.y[0, -1]), np.sin(exact.y[0, -1])])
    runs = [simulate(pendulum(), [], 10.0, n, scheme=GeneralisedAlpha(rho=1.0)) for n in (5000, 10000, 20000)]
    ends = [run.position[-1, :2] for run in runs]
    assert np.abs((4 * ends[2] - ends[1]) / 3 - end).max() < 1e-6
    drift = [np.abs(e - e[0]).max() for e in (run.mechanical_energy() for run in runs)]
    assert drift[1] < 1e-4
    assert drift[0] / drift[1] == pytest.approx(4.0, rel=0.02)
    sharp = simulate(pendulum(), [], 10.0, 500, scheme=RungeKutta8())
    np.testing.assert_allclose(sharp.position[-1, :2], end, atol=1e-10)
    assert np.abs(sharp.mechanical_energy()).max() < 1e-10


@pytest.mark.slow
def test_two_windows_undamped_keep_their_energy_as_in_joint_coordinates():
    # rho = 1 in independent coordinates: 1.4e-4 J at a millisecond, as measured in minimal coordinates
    runs = [simulate(four_bars(2), [], 10.0, n, scheme=GeneralisedAlpha(rho=1.0)) for n in (5000, 10000)]
    assert runs[0].scheme == IndependentAlpha(rho=1.0)
    assert "alternate" in runs[0].diagnosis.reason
    drift = [np.abs(e - e[0]).max() for e in (run.mechanical_energy() for run in runs)]
    assert drift[1] < 1.5e-4
    assert drift[0] / drift[1] == pytest.approx(4.0, rel=0.05)
    coarse, fine = (pin(run)[-1] for run in runs)
    np.testing.assert_allclose((4 * fine - coarse) / 3, (0.328458112, 0.944518538), atol=2e-6)
    assert np.abs(runs[1].joint_residuals()).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("steps", [9990, 9994, 10001, 10007, 12345])
def test_dead_points_are_stepped_over_wherever_the_nodes_fall(steps):
    run = simulate(four_bars(2), [], 10.0, steps, scheme=GeneralisedAlpha(rho=1.0))
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1.5e-4
    np.testing.assert_allclose(pin(run)[-1], (0.328458112, 0.944518538), atol=3e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("windows", "t_end"), [(1, 20.0), (3, 20.0), (10, 10.0)])
def test_more_windows_move_as_one_angle_does(windows, t_end):
    # all bars turn alike: (N + 1) m/3 + N m inertia, (N + 1)/2 + N weights at the pins
    inertia, weight = (windows + 1) / 3 + windows, 9.81 * ((windows + 1) / 2 + windows)
    exact = solve_ivp(
        lambda t, y: [y[1], -weight * np.cos(y[0]) / inertia], (0, t_end), [np.pi / 2, -1.0],
        method="DOP853", rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    run = simulate(four_bars(windows), [], t_end, round(1000 * t_end), scheme=GeneralisedAlpha(rho=1.0))
    end = np.array([np.cos(exact.y[0, -1]), np.sin(exact.y[0, -1])])
    np.testing.assert_allclose(pin(run)[-1], end, atol=5e-5)  # the library asks for 1e-3


@pytest.mark.slow
def test_order_eight_says_when_a_stage_falls_on_a_dead_point():
    said = []
    for steps in range(1000, 1020):
        try:
            said += simulate(four_bars(2), [], 10.0, steps, scheme=RungeKutta8()).diagnosis.notices
        except NotConverged as error:
            said.append(str(error))
    assert any("close to a dead point" in sentence for sentence in said)
    assert any("met a dead point" in s and "GeneralisedAlpha(rho=1), which steps over it" in s for s in said)
    run = simulate(four_bars(2), [], 0.7, 35, scheme=RungeKutta8())  # before the first dead point
    assert run.diagnosis.notices == ()
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-8


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
    assert "one too many, row 0" in run.diagnosis.notices[0]
    assert np.abs(run.joint_residuals()).max() < 1e-11
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-4
    undamped = simulate(doubled, [], 0.5, 1000, scheme=GeneralisedAlpha(rho=1.0))
    assert "set aside" in undamped.diagnosis.notices[0]
    energy = undamped.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-5
    assert np.abs(undamped.joint_residuals()).max() < 1e-12
    np.testing.assert_allclose(undamped.position[-1], run.position[-1], atol=1e-5)


def test_joints_that_agree_at_the_start_only_are_named():
    # the extra coupler is as long as the first, but its pins do not move alike: crank radii 1 and 0.5
    plain = four_bars(1)
    far, _ = rod("far", (0.0, 0.5), (1.0, 1.0), mass=1.0, velocity=(0.75, 0.0, 0.0))
    system = System(
        bodies=(*plain.bodies, far),
        joints=(
            *plain.joints,
            RevoluteJoint(a="far", b="bar0", point_a=(-np.hypot(1, 0.5) / 2, 0.0), point_b=(0.0, 0.0)),
            DistanceJoint(a="bar0", b="bar1", point_a=(0.0, 0.0), point_b=(0.5, 0.0), name="does not fit"),
        ),
        gravity=plain.gravity,
    )
    for scheme in (GeneralisedAlpha(), GeneralisedAlpha(rho=1.0)):
        with pytest.raises(
            (NotConverged, AssemblyError), match=r"does not fit|could not be closed|do not agree"
        ):
            simulate(system, [], 0.5, 100, scheme=scheme)


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


def squeezer():
    """Andrews' squeezing mechanism as seven free bodies, data of the IVP test set (I4 and B_x as in the
    original)."""
    angles = (
        -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
        -0.222668390165885885, 1.23054744454982119,
    )  # fmt: skip
    beta, theta, gamma, phi, delta, omega, epsilon = angles
    A, B, C = np.array([-0.06934, -0.00227]), np.array([-0.03635, 0.03273]), (0.014, 0.072)

    def along(angle):
        return np.array([np.cos(angle), np.sin(angle)])

    # body: mass, inertia, angle, a pin (global) and the centre of mass seen from it (body frame)
    crank_pin = 7e-3 * along(beta)
    G = A + 4e-2 * along(delta)
    H = A + 4e-2 * along(epsilon - np.pi / 2)
    parts = (
        (0.04325, 2.194e-6, beta, np.zeros(2), (92e-5, 0.0)),
        (0.00365, 4.410e-7, beta + theta, crank_pin, (-115e-4, 0.0)),
        (0.02373, 5.255e-6, gamma, B, (1874e-5, 1043e-5)),
        (0.00706, 5.667e-7, phi + delta, G, (0.0, -(2e-2 - 1421e-5))),
        (0.07050, 1.169e-5, delta, A, (2308e-5, 916e-5)),
        (0.00706, 5.667e-7, omega + epsilon, H, (2e-2 - 1421e-5, 0.0)),
        (0.05498, 1.912e-5, epsilon, A, (1228e-5, -449e-5)),
    )
    bodies, centre = [], []
    for i, (mass, inertia, angle, pin_at, c) in enumerate(parts):
        where = pin_at + c[0] * along(angle) + c[1] * along(angle + np.pi / 2)
        bodies.append(Body(
            name=f"K{i + 1}", mass=mass, inertia=inertia, position=(*where, angle), gravity=False,
        ))  # fmt: skip
        centre.append(np.array(c))

    def seen(i, point):  # a point of body i given from its pin, in its own frame, from its centre
        return tuple(np.array(point) - centre[i - 1])

    def pinned(i, point, j, other):
        return RevoluteJoint(a=f"K{i}", b=f"K{j}", point_a=seen(i, point), point_b=seen(j, other))

    def grounded(i, point):
        return RevoluteJoint(a=f"K{i}", b="ground", point_a=seen(i, (0.0, 0.0)), point_b=tuple(point))

    E = (-28e-3, 0.0)  # the common pin on body 2
    joints = (
        grounded(1, (0.0, 0.0)), pinned(2, (0.0, 0.0), 1, (7e-3, 0.0)), grounded(3, B),
        pinned(3, (0.0, -35e-3), 2, E), grounded(5, A), pinned(4, (0.0, 0.0), 5, (4e-2, 0.0)),
        pinned(4, (0.0, -2e-2), 2, E), grounded(7, A), pinned(6, (0.0, 0.0), 7, (0.0, -4e-2)),
        pinned(6, (2e-2, 0.0), 2, E),
    )  # fmt: skip
    spring = Member(
        a="K3", b="ground", point_a=seen(3, (2e-2, -18e-3)), point_b=C, law=Spring(k=4530.0),
        natural_length=7785e-5,
    )  # fmt: skip
    return System(bodies=bodies, joints=joints, members=(spring,), loads=(Load(body="K1", torque=0.033),))


def test_squeezer_of_andrews_at_three_hundredths_of_a_second():
    # values of the IVP test set at 0.03 s; an independent integration agrees to 1e-10
    expected = (
        15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
        0.5244099658805304, 0.5347301163226948, 1.048080741042263,
    )  # fmt: skip

    def relative(run):
        one, two, three, four, five, six, seven = (run.of(f"K{i}")[-1, 2] for i in range(1, 8))
        return np.array([one, two - one, three, four - five, five, six - seven, seven])

    runs = [
        simulate(squeezer(), [1.0], 0.03, steps, scheme=GeneralisedAlpha(rho=0.9)) for steps in (6000, 12000)
    ]
    coarse, fine = (relative(run) for run in runs)
    np.testing.assert_allclose((4 * fine - coarse) / 3, expected, atol=1e-6)
    assert np.abs(runs[1].joint_residuals()).max() < 1e-12
    # order 8; the printed starting angles close the loops to about 1e-9
    sharp = simulate(squeezer(), [1.0], 0.03, 200, scheme=RungeKutta8())
    np.testing.assert_allclose(relative(sharp), expected, atol=5e-9)
    undamped = simulate(squeezer(), [1.0], 0.03, 12000, scheme=GeneralisedAlpha(rho=1.0))
    np.testing.assert_allclose(relative(undamped), expected, atol=1e-4)


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
    [
        GeneralisedAlpha(rho=0.5),
        GeneralisedAlpha(rho=0.8),
        GeneralisedAlpha(rho=0.95),
        BDF2(),
        IndependentAlpha(rho=0.8),
        IndependentAlpha(),
    ],
    ids=["rho 0.5", "rho 0.8", "rho 0.95", "BDF2", "independent rho 0.8", "independent rho 1"],
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

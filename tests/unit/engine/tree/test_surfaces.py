"""Contacts and tyres against closed forms, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_trees import LATERAL, LONGITUDINAL, tree_run
from workbench.engine.errors import InvalidSystem, NotConverged
from workbench.engine.integration.schemes import GeneralisedAlpha, RungeKutta8
from workbench.engine.tree.joints import Floating, Planar, Prescribed, Prismatic, Revolute, SpatialMotion
from workbench.engine.tree.surfaces import Box, Capsule, Plane, Ring, Road, SpatialContact, Sphere, Tyre
from workbench.engine.tree.system import SpatialBody, TreeSystem

TYRE = Tyre(
    body="wheel", radius=0.45, stiffness=3.2e5, damping=3500.0, nominal_load=7000.0, lateral=LATERAL,
    longitudinal=LONGITUDINAL,
)  # fmt: skip
BALL = SpatialBody(name="ball", joint=Floating(position=(0.0, 0.0, 1.0)), mass=2.0, inertia=(0.01,) * 3)


def rolling(speed, angle, spin, *, tyre=TYRE, height=0.43, t_end=1.5):
    """A driven wheel at a slip angle and spin over a flat road; its slips at the end, and the run."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    carrier = SpatialBody(
        name="carrier",
        joint=Prescribed(
            motion=SpatialMotion(position=lambda t: (speed * t, 0.0, height), rotation=lambda t: turn)
        ),
    )
    drive = SpatialMotion(
        position=lambda t: (0.0, 0.0, 0.0),
        rotation=lambda t: np.array(
            [[np.cos(spin * t), 0, np.sin(spin * t)], [0, 1, 0], [-np.sin(spin * t), 0, np.cos(spin * t)]]
        ),
    )
    wheel = SpatialBody(name="wheel", parent="carrier", joint=Prescribed(motion=drive))
    free = SpatialBody(name="free", joint=Prismatic(), mass=1.0)  # something must move
    system = TreeSystem(bodies=(carrier, wheel, free), tyres=(tyre,))
    return tree_run(system, np.zeros(0), np.linspace(0.0, t_end, 301))


def test_a_tyre_settles_at_its_slip_angle_and_slip():
    angle = 0.05
    run = rolling(20.0, angle, 44.0)
    along, across = run.states[-1]
    # the patch moves with v - spin x radius ahead, and with v sideways; loaded radius 0.43
    assert across == pytest.approx(np.tan(angle), rel=1e-3)
    assert along == pytest.approx(44.0 * 0.43 / (20.0 * np.cos(angle)) - 1.0, rel=1e-3)
    assert run.state_names == ("longitudinal slip of 'wheel'", "lateral slip of 'wheel'")
    # relaxation: after one length 63 % of the slip angle
    early = np.interp(0.8 / (20.0 * np.cos(angle)), run.times, run.states[:, 1])
    assert early / across == pytest.approx(1.0 - np.exp(-1.0), abs=5e-3)


def test_a_wheel_that_slides_sideways_is_held_by_pacejkas_force():
    """A heavy wheel on a planar carriage: its deceleration is the tyre's lateral force over the mass."""
    mass, load = 700.0, 7000.0
    height = 0.45 - load / TYRE.stiffness
    carriage = SpatialBody(
        name="wheel", joint=Planar(position=(0.0, 0.0), velocity=(20.0, 1.0)), at=(0.0, 0.0, height),
        mass=mass, inertia=(50.0,) * 3,
    )  # fmt: skip
    spinning = SpatialBody(
        name="hub", parent="wheel", joint=Revolute(axis=(0.0, 1.0, 0.0), speed=20.0 / height),
        mass=1.0, inertia=(1.0, 1.0, 1.0),
    )  # fmt: skip
    tyre = replace(TYRE, body="hub", relaxation=0.02, damping=0.0)
    system = TreeSystem(bodies=(carriage, spinning), tyres=(tyre,))
    run = tree_run(system, np.zeros(0), np.linspace(0.0, 0.1, 401))
    node = 200
    slip = run.states[node, 1]
    force = tyre.force(slip, load, lateral=True)
    assert (mass + 1.0) * run.acceleration[node, 1] == pytest.approx(force, rel=2e-3)
    assert slip == pytest.approx(-run.velocity[node, 1] / 20.0, rel=2e-2)


def test_combined_slip_stays_within_the_ellipse():
    peaks = TYRE.peak(lateral=False), TYRE.peak(lateral=True)
    tops = (
        TYRE.force(peaks[0], 7000.0, lateral=False), TYRE.force(peaks[1], 7000.0, lateral=True),
    )  # fmt: skip
    assert tops[1] / 7000.0 == pytest.approx(0.776, abs=0.01)
    for slip in (0.5 * peaks[0], 3.0):
        assert TYRE.force(slip, 7000.0, lateral=False) < tops[0]
    for slip in (0.5 * peaks[1], 1.5):
        assert TYRE.force(slip, 7000.0, lateral=True) < tops[1]


def test_a_ball_comes_to_rest_where_the_plane_carries_it():
    contact = SpatialContact(
        a="ball", radius=0.1, shape=Plane(), k=1e5, damping=2.0, width=1e-4, friction=0.3
    )
    low = replace(BALL, joint=Floating(position=(0.0, 0.0, 0.1), velocity=(0.5, 0.0, 0.0)))
    run = tree_run(TreeSystem(bodies=(low,), contacts=(contact,)), np.zeros(0), np.linspace(0.0, 3.0, 6001))
    depth = (2.0 * 9.81 / 1e5) ** (2.0 / 3.0)
    assert run.of("ball")[-1, 2] == pytest.approx(0.1 - depth, abs=2e-6)
    # it slides, then rolls: spin about y with v = w r, momentum about the ground conserved
    v, w = run.velocity[-1, 0], run.velocity[-1, 4]
    assert w * 0.1 == pytest.approx(v, rel=1e-3)
    assert 2.0 * v * 0.1 + 0.01 * w == pytest.approx(2.0 * 0.5 * 0.1, rel=1e-3)


@pytest.mark.parametrize(
    ("shape", "height"),
    [
        (Sphere(centre=(0.0, 0.0, -0.5), radius=0.5), 0.0),
        (Capsule(start=(-1.0, 0.0, -0.2), end=(1.0, 0.0, -0.2), radius=0.2), 0.0),
        (Ring(centre=(0.3, 0.0, -0.05), radius=0.3, tube=0.05), 0.0),
        (Box(centre=(0.0, 0.0, -0.3), half=(0.5, 0.5, 0.3), rounding=0.1), 0.0),
    ],
)
def test_a_point_rests_on_top_of_a_shape(shape, height):
    """A slide along z presses a small ball on the highest point of a shape."""
    ball = SpatialBody(
        name="ball",
        joint=Prismatic(axis=(0.0, 0.0, 1.0), position=height + 0.02),
        mass=1.0,
        inertia=(0.1,) * 3,
    )
    contact = SpatialContact(a="ball", radius=0.02, shape=shape, k=1e4, power=1.0, damping=5.0, width=1e-6)
    run = tree_run(TreeSystem(bodies=(ball,), contacts=(contact,)), np.zeros(0), np.linspace(0.0, 2.0, 4001))
    assert run.of("ball")[-1, 2] == pytest.approx(height + 0.02 - 9.81 / 1e4, abs=2e-5)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (
            lambda: SpatialContact(a="x", b="x", shape=Plane(), k=1.0),
            "contact needs two bodies, got 'x' twice",
        ),
        (lambda: SpatialContact(a="x", shape=Plane(), k=1.0, width=0.0), "needs width > 0, slow > 0"),
        (lambda: Capsule(start=(0, 0, 0), end=(0, 0, 0), radius=1.0), "capsule needs two ends"),
        (lambda: Box(half=(1, 1, 1), rounding=2.0), "box needs 0 < rounding < its half sizes"),
        (lambda: Road(wavelength=0.0), "road needs wavelength, ramp and kerb_width > 0 m"),
        (lambda: replace(TYRE, lateral=(1.0,)), "8 lateral and 9 longitudinal coefficients, got 1 and 9"),
        (lambda: replace(TYRE, radius=0.0), "needs radius, stiffness"),
        (lambda: Plane(normal=(0, 0, 0)).numbers(), "plane needs a direction"),
    ],
)
def test_wrong_surfaces_are_refused_in_words(made, message):
    with pytest.raises(InvalidSystem, match=message):
        made()


def test_forces_of_a_run_are_those_that_moved_it():
    """A ball that bounces and slides: mass times acceleration less weight, at its foot."""
    ball = SpatialBody(
        name="ball",
        joint=Floating(position=(0.0, 0.0, 0.3), velocity=(2.0, 0.0, 0.0)),
        mass=2.0,
        inertia=(1, 1, 1),
    )
    ground = SpatialContact(a="ball", radius=0.1, shape=Plane(), k=5e3, power=1.0, damping=0.3, friction=0.4)
    run = tree_run(TreeSystem(bodies=(ball,), contacts=(ground,)), np.zeros(0), np.linspace(0.0, 0.4, 401))
    found = run.contact_forces()
    due = 2.0 * (run.acceleration[:, :3] - np.array([0.0, 0.0, -9.81]))
    touching = run.of("ball")[:, 2] < 0.1
    assert touching.any()
    assert found.force[:, 0] == pytest.approx(due, abs=1e-6 * np.abs(due).max())
    assert found.point[touching, 0, 2] == pytest.approx(run.of("ball")[touching, 2] - 0.1, abs=1e-12)
    assert run.tyre_forces().force.shape == (401, 0, 3)


def test_a_wheel_may_fall_flat():
    """A wheel that lies down beside its rolling neither pulls nor stops the run."""
    wheel = SpatialBody(
        name="wheel",
        joint=Floating(position=(0.0, 0.0, 0.48), orientation=(0.8, 0.6, 0.0, 0.0), spin=(1.0, 0.0, 0.0)),
        mass=70.0,
        inertia=(4.0, 8.0, 4.0),
    )
    hub = SpatialContact(a="wheel", radius=0.15, shape=Plane(), k=1e5, power=1.0, damping=0.5)
    system = TreeSystem(bodies=(wheel,), tyres=(replace(TYRE, body="wheel"),), contacts=(hub,))
    run = tree_run(system, np.zeros(0), np.linspace(0.0, 1.0, 1001))
    axle = run.frames("wheel").axes[:, 2, 1]
    assert axle.max() > 0.999
    flat = axle > 0.99
    assert np.abs(run.tyre_forces().force[flat]).max() == 0.0
    assert np.abs(run.states[flat]).max() < 10.0


def test_a_road_follows_any_smooth_profile():
    """A wheel that is led over a bump is pressed as the height of the bump says; the mean is no height."""
    height, length = (lambda s: 0.02 * np.sin(np.pi * s / 6.0) ** 4), 6.0
    road = Road(start=-60.0, heading=np.pi / 2.0).with_profile(height, length=length, count=8)
    carriage = SpatialBody(
        name="wheel", joint=Prescribed(motion=SpatialMotion(position=lambda t: (0.0, 6.0 * t, 0.42)))
    )
    free = SpatialBody(name="free", joint=Prismatic(), mass=1.0)
    soft = replace(TYRE, damping=0.0, axis=(1.0, 0.0, 0.0), road=road, rolling_resistance=0.0)
    run = tree_run(TreeSystem(bodies=(carriage, free), tyres=(soft,)), np.zeros(0), np.linspace(0.0, 1.0, 61))
    place = 6.0 * run.times
    e = 1e-6
    slope = np.array([(height(s + e) - height(s - e)) / (2.0 * e) for s in place])
    level = np.array([height(s) for s in place]) - 0.02 * 3.0 / 8.0
    depth = TYRE.radius - (0.42 - level) / np.sqrt(1.0 + slope**2)
    force = run.tyre_forces().force[:, 0]
    across = np.stack([np.zeros(61), -slope, np.ones(61)], axis=1) / np.sqrt(1.0 + slope**2)[:, None]
    assert np.einsum("ti,ti->t", force, across) == pytest.approx(TYRE.stiffness * depth, rel=1e-6)


def test_a_road_refuses_waves_without_length():
    with pytest.raises(InvalidSystem, match=r"road needs waves of \(amplitude, wavelength > 0, phase\), got"):
        Road(waves=((0.1, 0.0, 0.0),))
    with pytest.raises(InvalidSystem, match=r"profile needs length > 0 m and count >= 1, got 0.0 and 3"):
        Road().with_profile(lambda s: 0.0, length=0.0, count=3)


def test_a_run_that_stops_names_the_contact_that_pushed_hardest():
    ball = replace(BALL, joint=Floating(position=(0.0, 0.0, 0.35), velocity=(0.0, 0.0, -60.0)))
    aside = replace(ball, name="aside", joint=Floating(position=(1.0, 0.0, 2.0)))
    touches = {"shape": Plane(), "radius": 0.1, "k": 1e11, "damping": 5.0, "width": 1e-6}
    system = TreeSystem(
        bodies=(aside, ball),
        contacts=(SpatialContact(a="aside", **touches), SpatialContact(a="ball", **touches)),
    )
    with pytest.raises(
        NotConverged,
        match=r"stopped at t = 0\.\d+ s: 2 Newton .* near that time: contacts\[1\] of 'ball' on 'ground' "
        r"\(plane\) pushes hardest, [\d.e+]+ N",
    ) as stop:
        tree_run(system, np.zeros(0), np.linspace(0.0, 0.05, 501), GeneralisedAlpha(iterations=2))
    assert stop.value.time > 0.0


@pytest.mark.parametrize(
    ("scheme", "shape", "speed", "steps"),
    [
        (GeneralisedAlpha(), Capsule(start=(0.0, 0.0, -0.3), end=(0.0, 0.0, 0.3), radius=0.3), 1000.0, 3),
        (RungeKutta8(), Sphere(radius=0.5), 100.0, 5),
    ],
)
def test_a_run_that_diverges_stops_before_its_numbers_overflow(scheme, shape, speed, steps):
    """The laws of contacts are computed with complex numbers, whose division by 0 is an error of its own."""
    ball = replace(BALL, joint=Floating(position=(0.1, 0.05, 0.65), velocity=(0.0, 0.0, -speed)))
    hard = SpatialContact(a="ball", shape=shape, radius=0.2, k=1e12, damping=0.5, width=1e-4)
    system = TreeSystem(bodies=(ball,), contacts=(hard,))
    with pytest.raises(NotConverged, match="stopped"):
        tree_run(system, np.zeros(0), np.linspace(0.0, 1.0, steps + 1), scheme)

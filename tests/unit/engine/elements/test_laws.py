"""Member laws against plain formulas: printed numbers, slopes, energies, smooth corners."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.engine import (
    Airbag,
    Belt,
    Body,
    Bushing,
    Contact,
    Curve,
    Impulse,
    Load,
    LockingRetractor,
    Member,
    Retractor,
    Spring,
    System,
    Timed,
    VentedAirbag,
    Webbing,
    simulate,
)
from workbench.engine.planar._kernels.energy import member_energy_series
from workbench.engine.planar._kernels.equations import evaluate, place, unit_rows
from workbench.engine.planar._kernels.tables import work_space
from workbench.engine.planar.compiled import compiled, on_grid

LENGTH = 1.0


def look(law, delta, rate=0.0, t=0.0):
    """Force, df/ddelta, df/drate and energy of one member at a given elongation."""
    body = Body(name="a", mass=1.0, inertia=1.0, gravity=False)
    # a second, damped spring keeps the general kernels in use for every law
    keep = Member(a="a", b="ground", point_a=(0.0, 9.0), law=Spring(k=0.0, c=1e-30))
    member = Member(a="a", b="ground", law=law, natural_length=LENGTH)
    system = System(bodies=(body,), members=(member, keep))
    parts = compiled(system)
    tables = on_grid(parts, np.array([1.0, 0.0]), np.array([t]))
    work = work_space(tables)
    q, v = np.array([LENGTH + delta, 0.0, 0.0]), np.array([rate, 0.0, 0.0])
    none = np.zeros(0)
    evaluate(tables, work, 0, q, v, none, none, none, 0.0, True)
    by_delta, by_rate = work.k[0, 0], work.c[0, 0]
    place(tables, work, 0, q, v)
    unit_rows(tables, work, 0, np.zeros((3, 2)))
    at = int(np.flatnonzero(parts.order == 0)[0])
    force = work.f[at]
    energy = np.zeros(1)
    member_energy_series(tables, work, np.zeros(1, np.int64), q[None], v[None], energy)
    return force, by_delta, by_rate, energy[0]


def test_printed_numbers():
    # belt (8.26): 60 N at 15 mm (rounded there), 145 N at 100 mm; slack in compression
    assert look(Belt(), 0.1)[0] == pytest.approx(145.0)
    assert look(Belt(), 0.01)[0] == pytest.approx(40.0)
    assert look(Belt(), -0.05)[0] == 0.0
    # airbag (8.27), sign corrected: 0 at the onset, -1117 N at -0.13, printed c1 or the continuous one
    assert look(Airbag(), -0.005)[0] == pytest.approx(0.0, abs=0.01)
    for law in (Airbag(), Airbag(c1=1.818)):
        assert look(law, -0.13)[0] == pytest.approx(-1117.0, abs=0.5)
    assert look(Airbag(), 0.1)[0] == pytest.approx(0.0, abs=1e-12)
    assert look(Airbag(deploy=0.5), -0.1, t=0.4)[0] == 0.0
    # retractor (8.28): 500 N at its time, half of it 48 ms away
    assert look(Retractor(), 0.0, t=1.5)[0] == pytest.approx(500.0)
    assert look(Retractor(), 0.0, t=1.5 + np.sqrt(np.log(2) / 300))[0] == pytest.approx(250.0)
    # contact (2.3)
    assert look(Contact(k=100.0, c=2.0, gap=0.1), 0.3, rate=0.5)[0] == pytest.approx(21.0)
    assert look(Contact(k=100.0, gap=0.1), 0.05)[0] == 0.0
    assert look(Contact(k=100.0, gap=0.1, side=-1), -0.3)[0] == pytest.approx(-20.0)
    assert look(Spring(k=5.0, c=3.0), 0.2, rate=-1.0)[0] == pytest.approx(-2.0)


def test_a_curve_goes_through_its_points_and_on_beyond_them():
    points = ((-0.2, -50.0), (-0.1, -10.0), (0.0, 0.0), (0.05, 80.0), (0.1, 90.0))
    law = Curve(points=points, width=0.02)
    for (x, f), (y, g) in pairwise(points):
        assert look(law, 0.5 * (x + y))[0] == pytest.approx(0.5 * (f + g))
    assert look(law, -0.3)[0] == pytest.approx(-90.0)
    assert look(law, 0.2)[0] == pytest.approx(110.0)
    assert look(law, 0.0)[0] == pytest.approx(3.0 / 32.0 * 0.02 * (1600.0 - 100.0))  # rounded: 3 w/32 a kink
    assert look(Curve(points=points, c=4.0, scale=0.5), 0.075, rate=2.0)[0] == pytest.approx(50.5)
    assert look(law, 0.0)[3] == 0.0
    spring = Curve(points=((0.0, 1.0), (1.0, 6.0)))
    assert look(spring, 0.3)[0] == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("settings_", "said"),
    [
        ({"points": ((0.0, 0.0),)}, "a curve needs 2 to 14 points"),
        ({"points": tuple((float(k), 0.0) for k in range(15))}, "a curve needs 2 to 14 points"),
        ({"points": ((0.0, 0.0), (1.0, float("nan")))}, "a curve needs numbers, got .* as point 1"),
        (
            {"points": ((0.0, 0.0), (0.2, 1.0), (0.1, 2.0))},
            "elongations that ascend, got 0.2 m and then 0.1 m",
        ),
        ({"points": ((0.0, 0.0), (0.1, 2.0)), "width": 0.2}, "0 < width <= 0.1 m"),
    ],
)
def test_curves_that_cannot_be_are_refused(settings_, said):
    with pytest.raises(ValueError, match=said):
        Curve(**settings_)


def test_airbag_stiffens_on_and_on_past_its_cap():
    forces = [look(Airbag(), -x)[0] for x in np.linspace(0.0, 0.5, 60)]
    assert np.isfinite(forces).all()
    assert (np.diff(forces) <= 0.0).all()


LAWS = (
    Spring(k=50.0, c=2.0),
    Contact(k=300.0, c=1.0, gap=0.02, width=0.03),
    Contact(k=300.0, gap=0.02, width=0.03, side=-1),
    Belt(k1=300.0, k2=90.0, knee=0.02, width=0.02, c=0.5),
    Airbag(width=0.01),
    Impulse(f0=3.0, sigma=10.0, t0=0.1),
    Timed(law=Belt(k1=300.0, k2=90.0, knee=0.02, width=0.02, c=0.5), start=0.17, end=0.19, rise=0.015),
    Timed(law=Airbag(width=0.01), start=0.15, rise=0.09),
    Webbing(k=300.0, slack=0.02, limit=20.0, pull=0.05, fires=0.15, rise=0.1, speed=0.5, width=0.02),
    LockingRetractor(k=300.0, locks=0.15, paid=-0.02, limit=20.0, rise=0.1, speed=0.5, width=0.02),
    VentedAirbag(width=0.01, deploy=0.15, rise=0.09, returned=0.2, speed=0.5),
    Curve(
        points=((-0.1, -9.0), (-0.05, -2.0), (0.0, 0.5), (0.08, 4.0), (0.12, 3.0)),
        c=0.7,
        scale=1.3,
        width=0.03,
    ),
)
STEP = 1e-6


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@settings(max_examples=40, deadline=None)
@given(delta=st.floats(-0.2, 0.2), rate=st.floats(-1.0, 1.0))
def test_slopes_and_energy(law, delta, rate):
    f, by_delta, by_rate, _ = look(law, delta, rate, t=0.2)
    up, down = look(law, delta + STEP, rate, t=0.2), look(law, delta - STEP, rate, t=0.2)
    scale = 1.0 + abs(f) + abs(by_delta)
    assert (up[0] - down[0]) / (2 * STEP) == pytest.approx(by_delta, abs=2e-4 * scale)
    ahead, behind = look(law, delta, rate + STEP, t=0.2), look(law, delta, rate - STEP, t=0.2)
    assert (ahead[0] - behind[0]) / (2 * STEP) == pytest.approx(by_rate, abs=1e-6 * scale)
    if law.elastic:  # energy is the integral of the force without its damper
        static = look(law, delta, 0.0, t=0.2)[0]
        assert (up[3] - down[3]) / (2 * STEP) == pytest.approx(static, abs=1e-5 * scale)


def free_pair(seed):
    r = np.random.default_rng(seed)
    bodies = tuple(
        Body(
            name=name, mass=r.uniform(1, 5), inertia=r.uniform(0.1, 1),
            position=tuple(r.normal(size=3)), velocity=tuple(r.normal(size=3)), gravity=False,
        )
        for name in "ab"
    )  # fmt: skip
    members = tuple(
        Member(a="a", b="b", point_a=tuple(r.uniform(-1, 1, 2)), point_b=tuple(r.uniform(-1, 1, 2)), law=law)
        for law in LAWS * 2
    )
    return System(bodies=bodies, members=members)


def momenta(run):
    mass = run.tables.mass.reshape(-1, 3)
    q, v = run.position.reshape(len(run.times), -1, 3), run.velocity.reshape(len(run.times), -1, 3)
    linear = (mass[:, :2] * v[:, :, :2]).sum(axis=1)
    spin = mass[:, 2] * v[:, :, 2] + mass[:, 0] * (q[:, :, 0] * v[:, :, 1] - q[:, :, 1] * v[:, :, 0])
    return linear, spin.sum(axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_members_obey_newtons_third_law(seed):
    system = free_pair(seed)
    run = simulate(system, system.density(0.7), 0.5, 500)
    linear, angular = momenta(run)
    assert np.abs(linear - linear[0]).max() < 1e-11
    # angular momentum is kept by the motion; the scheme keeps it to second order
    fine = simulate(system, system.density(0.7), 0.5, 1000)
    drift, finer = (np.abs(x - x[0]).max() for x in (angular, momenta(fine)[1]))
    assert finer < 0.3 * drift + 1e-10


@pytest.mark.parametrize("seed", range(3))
def test_rigid_motion_and_renumbering_change_nothing(seed):
    system = free_pair(seed)
    density = np.random.default_rng(seed).uniform(0.2, 1.0, len(system.members))
    run = simulate(system, density, 0.3, 150)
    angle, shift = 0.7, np.array([3.0, -2.0])
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])

    def moved(body):
        p, v = turn @ body.position[:2] + shift, turn @ body.velocity[:2]
        return Body(
            name=body.name, mass=body.mass, inertia=body.inertia, gravity=False,
            position=(*p, body.position[2] + angle), velocity=(*v, body.velocity[2]),
        )  # fmt: skip

    order = np.random.default_rng(seed + 1).permutation(len(density))
    other = System(
        bodies=tuple(moved(b) for b in reversed(system.bodies)),
        members=tuple(system.members[i] for i in order),
    )
    again = simulate(other, density[order], 0.3, 150)
    for name in "ab":
        expected = run.of(name)[:, :2] @ turn.T + shift
        np.testing.assert_allclose(again.of(name)[:, :2], expected, atol=1e-10)
        np.testing.assert_allclose(again.of(name)[:, 2], run.of(name)[:, 2] + angle, atol=1e-10)


def test_a_damper_takes_what_the_energy_loses():
    body = Body(name="a", mass=1.0, inertia=1.0, velocity=(1.0, 0.0, 0.0), gravity=False)
    system = System(
        bodies=(body,), members=(Member(a="a", b="ground", point_b=(-1.0, 0.0), law=Spring(k=30.0, c=0.8)),)
    )
    run = simulate(system, [1.0], 2.0, 4000)
    lost = np.trapezoid(0.8 * run.velocity[:, 0] ** 2, run.times)
    energy = run.mechanical_energy()
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=1e-5)


def test_a_bushing_that_opens_one_way_holds_more_when_pressed_on():
    """A mass on an overloaded bushing accelerates by what the load exceeds the limit of its direction."""
    grip = Bushing(a="mass", b="ground", k=1e5, cap=100.0, opens=(1.0, 0.0), push_cap=300.0)

    def held(force):
        body = Body(name="mass", mass=1.0, inertia=1.0, gravity=False)
        system = System(bodies=(body,), bushings=(grip,), loads=(Load(body="mass", force=force),))
        return abs(np.hypot(*force) - np.hypot(*simulate(system, [], 0.5, 500).acceleration[-1, :2]))

    assert held((500.0, 0.0)) == pytest.approx(100.0, rel=1e-3)
    assert held((0.0, 500.0)) == pytest.approx(100.0, rel=1e-3)
    assert held((-500.0, 0.0)) == pytest.approx(300.0, rel=1e-3)


def test_a_window_is_closed_outside_and_open_inside():
    belt = Belt(c=3.0)
    timed = Timed(law=belt, start=0.2, end=0.5, rise=0.1)
    for t, share in ((0.2, 0.0), (0.25, 0.5), (0.3, 1.0), (0.5, 1.0), (0.55, 0.5), (0.6, 0.0), (9.0, 0.0)):
        for got, full in zip(look(timed, 0.1, 0.4, t), look(belt, 0.1, 0.4, t), strict=True):
            assert got == pytest.approx(share * full, abs=1e-12)
    assert look(Timed(law=belt), 0.1, 0.4) == look(belt, 0.1, 0.4)
    changed = timed.changed(k1=5e3, end=0.7)
    assert (changed.law.k1, changed.end, changed.start) == (5e3, 0.7, 0.2)


def test_windows_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="rise > 0"):
        Timed(law=Belt(), rise=0.0)
    with pytest.raises(ValueError, match=r"start \+ rise <= end"):
        Timed(law=Belt(), start=0.1, end=0.11, rise=0.02)
    for law in (Impulse(f0=1.0, sigma=1.0, t0=0.0), Timed(law=Belt())):
        with pytest.raises(ValueError, match="needs one of Spring, Contact, Belt, Airbag"):
            Timed(law=law)

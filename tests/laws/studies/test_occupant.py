"""What holds for the occupant in every case: energy, statics, order in grip, convergence, gradients."""

from dataclasses import replace

import numpy as np
import pytest

from studies.occupant import (
    CG,
    GRAVITY,
    JOINTS,
    MASSES,
    ONSET,
    SEGMENTS,
    Case,
    braking,
    system,
)
from workbench.engine import (
    Airbag,
    AtTime,
    Belt,
    Coordinate,
    Deviation,
    GeneralisedAlpha,
    Impulse,
    Maximum,
    Scalar,
    gradient,
    parameter_gradient,
    simulate,
)

T_END, STEPS = 2.0, 1000
LEFT = 1.0  # m: further than this he is out of reach of grips and seat
STATICS = 0.02  # of the force to be held; the occupant still swings a little at the end of the window
ENERGY = 1e-6  # of the work done, at the step of the test
HALVING = 0.01  # of the range of a response over the design
SLOPE = 1e-6  # relative, against central differences of fourth order
ROUGH = 3e-5  # the same for accelerations, in which the scheme amplifies rounding by 1/step^2
DEVIATION = Deviation(bodies=tuple(SEGMENTS), reference="vehicle", shares=MASSES)
RISE = Coordinate(bodies=tuple(SEGMENTS), reference="vehicle", shares=MASSES, relative=True)


def run(case, density=0.0, *, kinds=("belt", "airbag"), steps=STEPS, t_end=T_END, **laws):
    body = system(case, kinds=kinds, **laws)
    alpha = np.broadcast_to(np.asarray(density, float), (len(body.members),)).copy()
    return simulate(body, alpha, t_end=t_end, steps=steps, scheme=GeneralisedAlpha(tolerance=1e-12))


def bushing_forces(trajectory):
    """(bushings, nodes, 2): forces on the occupant, the printed law written out once more."""
    found = []
    for k, b in enumerate(trajectory.system.bushings):
        q, v = trajectory.of(b.a), trajectory.velocity[:, trajectory.system.coordinate(b.a)]
        c, s = np.cos(q[:, 2]), np.sin(q[:, 2])
        arm = np.stack([c * b.point_a[0] - s * b.point_a[1], s * b.point_a[0] + c * b.point_a[1]], axis=1)
        turned = np.stack([-arm[:, 1], arm[:, 0]], axis=1) * v[:, 2:]
        ground = trajectory.tables.motion
        r = q[:, :2] + arm - ground[:, 0, :2] - np.array(b.point_b)
        rate = v[:, :2] + turned - ground[:, 1, :2]
        length = np.sqrt((r**2).sum(axis=1) + b.eps**2)
        cap = np.full(len(r), b.cap)
        if b.opens is not None:
            x = np.clip(-(r @ np.array(b.opens)) / length, 0, 1)
            cap += (b.push_cap - b.cap) * x**3 * (10 - 15 * x + 6 * x**2)
        x = np.clip((length - b.slip) / (b.release - b.slip), 0, 1)
        strength = b.hold * (1 - trajectory.damage[:, k]) * (1 - x**3 * (10 - 15 * x + 6 * x**2))
        u = b.k * length / cap
        force = (cap * np.tanh(u) / length)[:, None] * r + b.c * rate / np.cosh(u)[:, None] ** 2
        found.append(-strength[:, None] * (force - np.array(b.preload)))
    return np.array(found)


@pytest.mark.parametrize("hands", [0, 1, 2])
@pytest.mark.parametrize("mass", [60.0, 95.0])
def test_the_start_is_an_equilibrium(hands, mass):
    factors = {"elbow": 2.0, "shoulder TX": 0.5}
    before = run(Case(hands=hands, mass=mass, factors=factors, seat_cap=300.0), steps=250, t_end=ONSET)
    assert DEVIATION.values(before).max() < 1e-16


def test_the_restraints_carry_the_braking_force():
    """77 kg at 7 m/s2 need 539 N, 270 N for each hand if the hands had it all: below every grip strength."""
    trajectory = run(Case(), t_end=2.9, steps=1450)
    late = trajectory.times > 2.0
    forces = bushing_forces(trajectory)[:, late]
    grips, seat = forces[:, :, 0].mean(axis=1)
    assert grips + seat == pytest.approx(539.0, rel=STATICS)
    assert forces[:, :, 1].mean(axis=1).sum() == pytest.approx(77.0 * GRAVITY, rel=STATICS)


def test_the_hands_carry_it_all_once_the_seat_has_opened():
    """269.5 N each, and what his swing about the grips adds: there is no equilibrium on the hands alone."""
    stiff = dict.fromkeys(("elbow", "shoulder TX", "wrist TX", "hip TX"), 50.0)
    trajectory = run(Case(seat_rate=1.0, grip=700.0, factors=stiff), t_end=2.9, steps=2900)
    late = (trajectory.times > 1.5) & (trajectory.times < 2.9)
    grips, seat = bushing_forces(trajectory)[:, late, 0]
    assert np.abs(seat).max() == 0.0
    t, mass = trajectory.times[late], trajectory.tables.mass[0::3]
    speed = (trajectory.velocity[late, 0::3] - trajectory.tables.motion[late, 1, 0][:, None]) @ mass
    per_hand = 0.5 * (np.trapezoid(grips, t) - (speed[-1] - speed[0])) / (t[-1] - t[0])
    assert per_hand == pytest.approx(269.5, rel=STATICS)


def test_grips_and_seat_alone_move_the_mass_centre():
    trajectory = run(Case(hands=1, grip=400.0, deceleration=9.0))
    mass = trajectory.tables.mass[0::3]
    momentum = np.stack([trajectory.acceleration[:, k::3] @ mass for k in (0, 1)], axis=1)
    momentum[:, 1] += mass.sum() * GRAVITY
    forces = bushing_forces(trajectory).sum(axis=0)
    # the scheme balances forces between nodes, not at them
    assert np.abs(forces - momentum)[10:].max() < 0.02 * np.abs(forces).max()


@pytest.mark.parametrize(
    "case", [Case(), Case(hands=0, deceleration=9.0, mass=95.0), Case(hands=1, grip=350.0, seat_cap=300.0)]
)
def test_energy_seen_from_the_vehicle_is_the_work_done(case):
    """d/dt of kinetic + potential + stored = power of braking, grips, seat, joints and muscles."""
    trajectory = run(case, 0.1, steps=16_000, t_end=1.0)
    body, t = trajectory.system, trajectory.times
    seen = trajectory.velocity.copy()
    vehicle = trajectory.tables.motion[:, 1, 0]
    seen[:, 0::3] -= vehicle[:, None]
    energy = 0.5 * seen**2 @ trajectory.tables.mass + trajectory.stored_energy()
    energy += trajectory.spring_energy() + trajectory.gravity_energy()
    braking = np.array([next(b for b in body.bodies if b.motion).motion.push(s)[0] for s in t])
    power = -braking * (seen[:, 0::3] @ trajectory.tables.mass[0::3])
    for b, force in zip(body.bushings, bushing_forces(trajectory), strict=True):
        at = body.coordinate(b.a)
        angle = trajectory.of(b.a)[:, 2]
        c, s = np.cos(angle), np.sin(angle)
        arm = (c * b.point_a[0] - s * b.point_a[1], s * b.point_a[0] + c * b.point_a[1])
        v = seen[:, at]
        power += force[:, 0] * (v[:, 0] - arm[1] * v[:, 2]) + force[:, 1] * (v[:, 1] + arm[0] * v[:, 2])
    for s in body.springs:
        rate = seen[:, body.coordinate(s.a)][:, 2] - seen[:, body.coordinate(s.b)][:, 2]
        power -= s.c * rate**2
    for load in body.loads:
        power += load.torque * seen[:, body.coordinate(load.body)][:, 2]
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(t))])
    done = np.abs(power).sum() * (t[1] - t[0])
    assert np.abs(energy - energy[0] - work).max() < ENERGY * done
    assert done > 10.0  # J: something happened


def test_a_weaker_grip_is_never_better():
    for hands in (1, 2):
        for seat_cap, mass in ((1000.0, 77.0), (500.0, 95.0)):
            peaks = []
            for grip in range(350, 701, 50):
                case = Case(grip=float(grip), hands=hands, deceleration=8.5, seat_cap=seat_cap, mass=mass)
                peaks.append(np.sqrt(DEVIATION.values(run(case, kinds=("belt",))).max()))
            # who has left flies; how far tells nothing about his grip
            assert np.diff(np.minimum(peaks, LEFT)).max() < 1e-3


def test_hands_off_is_far_worse_than_both_hands_on_at_any_grip():
    off = DEVIATION.values(run(Case(hands=0))).max()
    for grip in (350.0, 500.0, 700.0):
        assert DEVIATION.values(run(Case(grip=grip))).max() < 0.02 * off


def test_halving_the_step_hardly_changes_the_responses():
    rng = np.random.default_rng(7)
    names = [name for name in JOINTS if name not in ("lumbar", "thoracic", "neck")]
    peaks, rises = [], []
    for _ in range(20):
        case = Case(
            grip=rng.uniform(350, 700), hands=int(rng.integers(0, 3)), deceleration=rng.uniform(6, 9),
            seat_rate=rng.uniform(5e3, 2e4), seat_cap=rng.uniform(300, 1000), mass=rng.uniform(60, 95),
            factors=dict(zip(names, 2.0 ** rng.uniform(-1, 1, len(names)), strict=True)),
        )  # fmt: skip
        both = [run(case, 0.03, steps=n) for n in (STEPS, 2 * STEPS)]
        peaks.append([np.sqrt(DEVIATION.values(r).max()) for r in both])
        rises.append([RISE.values(r).max() for r in both])
    for found in (np.array(peaks), np.array(rises)):
        assert np.abs(found[:, 0] - found[:, 1]).max() < HALVING * np.ptp(found)


DECELERATION = 8.0
VEHICLE = braking(DECELERATION)


def head_speed(t, q, v, w, density):
    """Squared speed of the head seen from the vehicle, m2/s2."""
    return (v[0] - VEHICLE.speed(t)[0]) ** 2 + v[1] ** 2


def torso_acceleration(t, q, v, w, density):
    """Squared acceleration of the upper torso, m2/s4."""
    return w[3] ** 2 + w[4] ** 2


OBJECTIVES = {
    "deviation": Maximum(quantity=DEVIATION),
    "rise": Maximum(quantity=RISE),
    "head speed": AtTime(quantity=Scalar(function=head_speed), time=0.7),
    "torso acceleration": AtTime(quantity=Scalar(function=torso_acceleration), time=0.6),
}


def quotient(value, e):
    return (8 * (value(e) - value(-e)) - (value(2 * e) - value(-2 * e))) / (12 * e)


@pytest.mark.parametrize("name", OBJECTIVES)
@pytest.mark.parametrize("hands", [1, 2])
def test_gradients_are_those_of_differences(name, hands):
    objective, rng = OBJECTIVES[name], np.random.default_rng(3)
    case = Case(hands=hands, grip=400.0, deceleration=DECELERATION, factors={"elbow": 1.3})
    laws = {"belt": Belt(), "airbag": Airbag(), "retractor": Impulse(f0=20.0, sigma=300.0, t0=0.6)}
    kinds = tuple(laws)
    density = rng.uniform(0.01, 0.05, 540)
    direction = rng.normal(size=540) * 0.01
    trajectory = run(case, density, kinds=kinds, steps=600, t_end=1.2, **laws)
    found = parameter_gradient(trajectory, objective)

    def at(*, density=density, case=case, **changed):
        return objective.value(run(case, density, kinds=kinds, steps=600, t_end=1.2, **{**laws, **changed}))

    def checked(got, value, e):
        slope = ROUGH if name == "torso acceleration" else SLOPE
        floor = 1e-3 * slope * objective.value(trajectory) / e
        assert got == pytest.approx(quotient(value, e), rel=slope, abs=floor)

    by_density = gradient(trajectory.system, density, trajectory, objective)
    checked(by_density @ direction, lambda e: at(density=density + e * direction), 0.1)
    # both hands in one bushing: its cap is twice the grip strength of a hand
    checked(2 * found.bushing[2, 0], lambda e: at(case=replace(case, grip=case.grip + e)), 1.0)
    checked(found.bushing[0, 1], lambda e: at(case=replace(case, seat_rate=case.seat_rate + e)), 20.0)
    elbow = list(JOINTS).index("elbow")
    k = JOINTS["elbow"].stiffness
    checked(k * found.spring[0, elbow], lambda e: at(case=replace(case, factors={"elbow": 1.3 + e})), 1e-3)
    checked(found.law[1, :180].sum(), lambda e: at(belt=Belt(k2=1000.0 + e)), 20.0)
    onset, length, power = laws["airbag"].onset, laws["airbag"].length, laws["airbag"].power
    by_c0 = found.law[0, 180:360].sum() + (length - onset) ** power * found.law[1, 180:360].sum()
    checked(by_c0, lambda e: at(airbag=Airbag(c0=30.0 + e)), 0.5)
    checked(found.law[0, 360:].sum(), lambda e: at(retractor=replace(laws["retractor"], f0=20.0 + e)), 0.3)


@pytest.mark.slow
@pytest.mark.count
def test_a_thousand_random_designs_give_numbers():
    rng = np.random.default_rng(11)
    body = system(Case(hands=0, deceleration=9.0, mass=95.0), kinds=("belt", "airbag"))
    for _ in range(1000):
        density = rng.random(360) * (rng.random(360) < 10 ** rng.uniform(-2, 0))
        trajectory = simulate(body, density, t_end=T_END, steps=STEPS)
        found = gradient(body, density, trajectory, Maximum(quantity=DEVIATION))
        assert np.isfinite(trajectory.position).all()
        assert np.isfinite(found).all()


def test_the_reference_posture_has_its_mass_centre_above_the_seat():
    assert CG == pytest.approx((0.177, 0.986), abs=1e-3)

"""The discrete adjoint equals difference quotients on random systems of bodies, joints and laws."""

from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np
import pytest

from studies import three_body, two_body
from workbench.engine import (
    BDF2,
    Airbag,
    Belt,
    Body,
    Bushing,
    Contact,
    Coordinate,
    Deviation,
    DistanceJoint,
    DrivenJoint,
    Impulse,
    Integral,
    JointSpring,
    Load,
    LockingRetractor,
    Maximum,
    Member,
    Motion,
    PNorm,
    PrismaticJoint,
    RevoluteJoint,
    Spring,
    StoredEnergy,
    System,
    Terminal,
    Timed,
    VentedAirbag,
    Webbing,
    gradient,
    gradients,
    parameter_gradient,
    simulate,
)
from workbench.engine.planar._kernels.energy import member_energy_series

sweep = import_module("workbench.engine.planar.adjoint")

SAME = 1e-12  # the same operations in another order
QUOTIENT = 2e-6  # fourth-order differences of runs with rounded kinks crossed between the points

LAWS = (
    lambda r: Spring(k=r.uniform(50, 500)),
    lambda r: Spring(k=r.uniform(50, 500), c=r.uniform(1, 20)),
    lambda r: Contact(k=r.uniform(100, 900), c=r.uniform(0, 9), gap=r.uniform(0, 0.02), width=0.02),
    lambda r: Contact(k=r.uniform(100, 900), gap=r.uniform(0, 0.02), width=0.02, side=-1),
    lambda r: Impulse(f0=r.uniform(-9, 9), sigma=r.uniform(50, 400), t0=r.uniform(0.05, 0.15)),
    lambda r: Belt(k1=r.uniform(300, 900), k2=r.uniform(50, 200), knee=0.02, width=0.015, c=r.uniform(0, 5)),
    lambda r: Airbag(c0=r.uniform(10, 40), length=0.16, cap=0.12, width=0.004, deploy=0.02, rise=0.05),
    lambda r: Timed(law=Spring(k=r.uniform(50, 500), c=3.0), start=0.0313, end=0.1217, rise=0.03),
    lambda r: Webbing(
        k=r.uniform(300, 900),
        slack=0.005,
        limit=r.uniform(5, 9),
        pull=0.03,
        fires=0.04,
        rise=0.04,
        speed=0.3,
        width=0.015,
    ),
    lambda r: LockingRetractor(
        k=r.uniform(300, 900),
        locks=0.05,
        tension=0.4,
        limit=r.uniform(5, 9),
        rise=0.04,
        speed=0.3,
        width=0.015,
    ),
    lambda r: VentedAirbag(
        c0=r.uniform(10, 40),
        c1=1.0,
        length=0.16,
        cap=0.12,
        width=0.004,
        deploy=0.02,
        rise=0.05,
        returned=0.1,
        speed=0.3,
    ),
)


def random_system(seed, *, joints=True):
    r = np.random.default_rng(seed)
    shake = Motion(
        position=lambda t: (0.02 * np.sin(9 * t), 0.01 * t, 0.05 * np.sin(7 * t)),
        velocity=lambda t: (0.18 * np.cos(9 * t), 0.01, 0.35 * np.cos(7 * t)),
    )
    bodies = [
        Body(
            name=f"{i}", mass=r.uniform(1, 5), inertia=r.uniform(0.1, 0.6),
            position=(0.5 * i, r.uniform(-0.2, 0.2), r.uniform(-0.5, 0.5)),
            velocity=(0.0, 0.0, 0.0) if joints else tuple(r.normal(size=3)),
        )
        for i in range(3)
    ]  # fmt: skip
    bodies.append(Body(name="frame", motion=shake))
    names = ["0", "1", "2", "frame", "ground"]
    members = []
    for law in LAWS * 2:
        a, b = r.choice(5, 2, replace=False)
        if {a, b} == {3, 4}:
            a = 0
        members.append(
            Member(
                a=names[a], b=names[b],
                point_a=tuple(r.uniform(-0.3, 0.3, 2)), point_b=tuple(r.uniform(-0.3, 0.3, 2)),
                law=law(r), power=float(r.choice([1.0, 3.0])), offset=float(r.uniform(0, 0.3)),
            )
        )  # fmt: skip
    springs = (
        JointSpring(a="0", b="1", k=3.0, c=0.2, k_stop=30.0, upper=0.05, lower=0.1, width=0.05),
        JointSpring(a="2", b="frame", k=2.0, c=0.1),
    )
    bushings = (
        Bushing(
            a="1", b="frame", point_a=(0.1, 0.0), point_b=(0.55, 0.05), k=300.0, c=4.0, cap=6.0,
            slip=0.03, release=0.08, width=0.01, eps=0.01, preload=(0.5, 1.0),
        ),
        Bushing(a="2", b="0", point_a=(-0.2, 0.0), point_b=(0.4, 0.0), k=50.0, c=2.0),
    )  # fmt: skip
    system = System(
        bodies=bodies, members=members, springs=springs, bushings=bushings,
        loads=(
            Load(body="0", force=lambda t: (5 * np.sin(20 * t), 3.0), torque=0.3, point=(0.1, -0.1)),
            Load(body="2", force=(2.0, 1.0), point=(0.1, 0.2), follower=True),
        ),
    )  # fmt: skip
    if joints:
        pin = system.bodies[1].position
        system = replace(
            system,
            joints=(
                DistanceJoint(a="0", b="1", point_a=(0.1, 0.1), point_b=(-0.1, 0.0)),
                PrismaticJoint(a="2", b="ground", point_b=bodies[2].position[:2], axis=(1.0, 0.3)),
                RevoluteJoint(a="1", b="ground", point_b=pin[:2]),
                DrivenJoint(a="0", b="ground", motion=lambda t: 0.1 * t**2, from_start=True),
            ),
        )
    return system, r


OBJECTIVES = (
    Maximum(quantity=Deviation(bodies=("0", "1"), reference="2", weights=(1.0, 2.0))),
    Maximum(quantity=StoredEnergy()),
    Integral(quantity=StoredEnergy()),
    Terminal(quantity=Coordinate(bodies=("0",), reference="frame", direction=(0.6, 0.8))),
    PNorm(quantity=Deviation(bodies=("2",), reference="frame"), p=8.0),
)


def quotient(value, e):
    return (8 * (value(e) - value(-e)) - (value(2 * e) - value(-2 * e))) / (12 * e)


@pytest.mark.parametrize("joints", [False, True], ids=["free", "jointed"])
@pytest.mark.parametrize("seed", range(50))
def test_densities(seed, joints):
    system, r = random_system(seed, joints=joints)
    density = r.uniform(0.3, 0.9, len(system.members))
    direction = r.normal(size=len(density))
    objective = OBJECTIVES[seed % len(OBJECTIVES)]
    run = simulate(system, density, 0.2, 100)
    found = gradient(system, density, run, objective) @ direction

    def value(e):
        return objective.value(simulate(system, density + e * direction, 0.2, 100))

    assert found == pytest.approx(quotient(value, 1e-4), rel=QUOTIENT, abs=1e-12)


@pytest.mark.parametrize("joints", [False, True], ids=["free", "jointed"])
def test_rows_of_one_sweep_are_the_gradients_one_by_one(joints, monkeypatch):
    system, r = random_system(7, joints=joints)
    density = r.uniform(0.3, 0.9, len(system.members))
    run = simulate(system, density, 0.2, 60)
    early = Maximum(quantity=OBJECTIVES[0].quantity, window=(0.0, 0.05))
    objectives = (*OBJECTIVES, early, OBJECTIVES[0])
    singles = np.array([gradient(system, density, run, objective) for objective in objectives])
    np.testing.assert_allclose(gradients(system, density, run, objectives), singles, rtol=SAME, atol=1e-14)
    assert np.linalg.matrix_rank(singles) > 4
    # rows that do not fit are swept in portions
    monkeypatch.setattr(sweep, "ROWS", 1.0)
    monkeypatch.setattr(sweep, "STRETCH", 1.0)  # and the equations linearised node by node
    np.testing.assert_allclose(gradients(system, density, run, objectives), singles, rtol=SAME, atol=1e-14)
    assert gradients(system, density, run, ()).shape == (0, len(density))


def test_a_run_knows_its_energies():
    for record in (two_body.problem("C"), three_body.problem()):
        run = simulate(record.system, record.density, record.t_end, 60)
        summed = np.empty(61)
        member_energy_series(
            run.tables, run.work, np.arange(61), run.nodes.position, run.nodes.velocity, summed
        )
        assert len(run.tangents.energy)
        np.testing.assert_allclose(run.stored_energy(), summed, rtol=SAME, atol=1e-12 * summed.max())


def test_rows_with_redundant_joints_and_with_other_schemes():
    record = three_body.problem()
    twice = replace(record.system, joints=record.system.joints * 2)
    objectives = (record.objective, Terminal(quantity=StoredEnergy()))
    for system, scheme in ((twice, None), (record.system, BDF2())):
        run = simulate(system, record.density, record.t_end, 40, scheme=scheme)
        assert bool(run.diagnosis.redundant_rows) is (scheme is None)
        singles = [gradient(system, record.density, run, objective) for objective in objectives]
        rows = gradients(system, record.density, run, objectives)
        np.testing.assert_allclose(rows, singles, rtol=SAME, atol=1e-14)
    with pytest.raises(ValueError, match="trajectory belongs to another system"):
        gradients(twice, record.density, run, objectives)


def test_coincident_ends_and_vanishing_lengths_give_numbers():
    # ends that meet, a natural length of nothing, ends that meet on the way: b = 0 there, never 0/0
    body = Body(name="a", mass=1.0, inertia=0.2, position=(0.1, 0.0, 0.0), velocity=(-1.0, 0.0, 0.3))
    laws = (Spring(k=30.0), Spring(k=30.0, c=1.0), Belt(k1=300.0, k2=90.0, knee=0.02, width=0.01),
            Contact(k=50.0, width=0.01), Airbag())  # fmt: skip
    members = [Member(a="a", b="ground", point_b=(0.1, 0.0), law=law) for law in laws]
    members += [Member(a="a", b="ground", law=law, natural_length=0.0) for law in laws[:3]]
    system = System(bodies=(body,), members=members)
    density = np.full(len(members), 0.5)
    objective = Integral(quantity=Deviation(bodies=("a",)))
    run = simulate(system, density, 0.2, 400)
    found = gradient(system, density, run, objective)
    assert np.isfinite(run.position).all()
    assert np.isfinite(found).all()
    parameters = parameter_gradient(run, objective)
    assert all(np.isfinite(getattr(parameters, name)).all() for name in ("law", "natural_length", "mass"))
    # alone, the springs that meet no kink on the way agree with differences too
    smooth = System(bodies=(replace(body, position=(0.1, 0.05, 0.0)),), members=members[:2])
    direction = np.array([0.6, -0.8])

    def value(e):
        return objective.value(simulate(smooth, density[:2] + e * direction, 0.2, 400))

    found = gradient(smooth, density[:2], simulate(smooth, density[:2], 0.2, 400), objective) @ direction
    assert found == pytest.approx(quotient(value, 1e-4), rel=QUOTIENT)


def number(law, name):
    return law.parameters[law.names.index(name)]


def bump(system, kind, index, name, e):
    part = getattr(system, kind)[index]
    if kind == "members" and name != "natural_length":
        law = part.law
        change = law.changed if isinstance(law, Timed) else partial(replace, law)
        new = replace(part, law=change(**{name: number(law, name) + e}))
    else:
        new = replace(part, **{name: getattr(part, name) + e})
    return replace(
        system, **{kind: tuple(new if i == index else p for i, p in enumerate(getattr(system, kind)))}
    )


PARAMETERS = [
    *[("members", 1, name) for name in ("k", "c")],
    *[("members", 2, name) for name in ("k", "c", "gap")],
    *[("members", 3, name) for name in ("k", "gap")],
    *[("members", 4, name) for name in ("f0", "sigma", "t0")],
    *[("members", 5, name) for name in ("k1", "k2", "knee", "c")],
    *[("members", 6, name) for name in ("c0", "c1", "length", "power", "onset", "deploy")],
    *[("members", 7, name) for name in ("k", "c", "start", "end")],
    *[("members", 8, name) for name in ("k", "slack", "limit", "pull", "fires", "returned")],
    *[("members", 9, name) for name in ("k", "paid", "limit", "tension", "locks", "returned")],
    *[("members", 10, name) for name in ("c0", "length", "deploy", "returned")],
    ("members", 0, "natural_length"),
    *[("springs", 0, name) for name in ("k", "c", "rest", "k_stop", "upper", "lower")],
    *[("bushings", 0, name) for name in ("k", "c", "cap", "hold")],
    ("bodies", 0, "mass"),
    ("bodies", 1, "inertia"),
]


@pytest.fixture(scope="module")
def prepared():
    system, _ = random_system(11, joints=True)
    members = list(system.members)
    # every law is loaded: ends far enough apart, natural lengths that stretch or squeeze
    stretch = {2: -0.05, 3: 0.06, 5: -0.05, 6: 0.05, 8: -0.01, 9: -0.01, 10: 0.05}
    for i, member in enumerate(members):
        members[i] = replace(
            member, a="0", b="ground", point_a=(0.1, 0.1 * i / 7), point_b=(0.3, 0.5), offset=0.2
        )
        law = member.law
        if isinstance(law, Airbag):
            law = replace(law, c1=law.c0 * (law.length - law.onset) ** law.power)
        members[i] = replace(members[i], law=law)
    lengths = []
    place = np.array(system.bodies[0].position)
    for i, member in enumerate(members):
        c, s = np.cos(place[2]), np.sin(place[2])
        p = place[:2] + np.array([[c, -s], [s, c]]) @ np.array(member.point_a) - np.array(member.point_b)
        lengths.append(float(np.sqrt(p @ p + member.offset**2)) + stretch.get(i % len(LAWS), 0.01))
    members = [replace(m, natural_length=length) for m, length in zip(members, lengths, strict=True)]
    springs = (replace(system.springs[0], rest=0.1), system.springs[1])
    x, y, th = system.bodies[1].position
    near = (x + 0.1 * np.cos(th) + 0.01, y + 0.1 * np.sin(th) - 0.01)
    bushings = (replace(system.bushings[0], point_b=near), system.bushings[1])
    return replace(system, members=tuple(members), springs=springs, bushings=bushings)


@pytest.mark.parametrize(("kind", "index", "name"), PARAMETERS, ids=lambda x: str(x))
def test_parameters_of_laws_springs_bushings_and_bodies(prepared, kind, index, name):
    system = prepared
    density = np.full(len(system.members), 0.8)
    objective = Terminal(quantity=Deviation(bodies=("0", "1"), reference="2"))
    found = parameter_gradient(simulate(system, density, 0.2, 60), objective)
    if kind == "members":
        got = (
            found.natural_length[index]
            if name == "natural_length"
            else found.law[system.members[index].law.names.index(name), index]
        )
    elif kind == "springs":
        got = found.spring[("k", "c", "rest", "k_stop", "upper", "lower").index(name), index]
    elif kind == "bushings":
        got = found.bushing[("k", "c", "cap", "hold").index(name), index]
    else:
        got = getattr(found, name)[index]

    def value(e):
        return objective.value(simulate(bump(system, kind, index, name, e), density, 0.2, 60))

    part = getattr(system, kind)[index]
    by_law = kind == "members" and name != "natural_length"
    now = number(part.law, name) if by_law else getattr(part, name)
    step = 1e-4 * max(abs(now), 0.1)
    assert got == pytest.approx(quotient(value, step), rel=QUOTIENT, abs=3e-11)
    assert got != 0.0 or name in ("lower", "upper")


@pytest.mark.parametrize("angle", [0.3, 1.8, 3.6, 5.2])
def test_a_cap_of_one_direction_has_exact_gradients(prepared, angle):
    old = prepared.bushings[0]
    directed = replace(old, opens=(float(np.cos(angle)), float(np.sin(angle))), push_cap=40.0)
    system = replace(prepared, bushings=(directed, prepared.bushings[1]))
    density = np.full(len(system.members), 0.8)
    direction = np.random.default_rng(3).normal(size=len(density))
    objective = Terminal(quantity=Deviation(bodies=("0", "1"), reference="2"))
    found = parameter_gradient(simulate(system, density, 0.2, 60), objective)

    def by_density(e):
        return objective.value(simulate(system, density + e * direction, 0.2, 60))

    def by_cap(e):
        return objective.value(simulate(bump(system, "bushings", 0, "cap", e), density, 0.2, 60))

    assert found.density @ direction == pytest.approx(quotient(by_density, 1e-4), rel=QUOTIENT, abs=1e-12)
    assert found.bushing[2, 0] == pytest.approx(quotient(by_cap, 6e-4), rel=QUOTIENT, abs=3e-11)

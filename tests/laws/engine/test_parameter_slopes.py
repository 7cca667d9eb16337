"""Slopes by parameters of planar and natural systems equal differences of runs, under every scheme."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.engine import (
    BDF2,
    Body,
    Bushing,
    Coordinate,
    DistanceJoint,
    GeneralisedAlpha,
    IndependentAlpha,
    Load,
    Member,
    RevoluteJoint,
    RungeKutta8,
    Spring,
    System,
    Terminal,
    UserLaw,
    parameter_gradient,
    parameter_slopes,
    simulate,
)

EXACT = 1e-7  # differences of fourth order of smooth runs leave 1e-11 to 1e-8
SAME = 1e-9  # the closed contraction against differences of the equations
END = Terminal(quantity=Coordinate(bodies=("0", "2"), direction=(1.0, 0.3)))


def quotient(f, x):
    h = 3e-4 * (abs(x) or 1.0)
    return (8.0 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12.0 * h)


def sprung_bodies(seed, *, joints, law=Spring):
    """Three bodies on damped springs, one pinned and one on a rod if joints."""
    r = np.random.default_rng(seed)
    bodies = [
        Body(
            name=f"{i}", mass=r.uniform(1, 5), inertia=r.uniform(0.1, 0.6),
            position=(0.5 * i, r.uniform(-0.2, 0.2), r.uniform(-0.5, 0.5)),
            velocity=(0.0, 0.0, 0.0) if joints else tuple(r.normal(size=3)),
        )
        for i in range(3)
    ]  # fmt: skip
    names, members = ["0", "1", "2", "ground"], []
    for _ in range(8):
        a, b = r.choice(4, 2, replace=False)
        members.append(
            Member(
                a=names[a], b=names[b], point_a=tuple(r.uniform(-0.3, 0.3, 2)), natural_length=0.4,
                point_b=tuple(r.uniform(-0.3, 0.3, 2)), law=law(k=r.uniform(50, 300), c=r.uniform(1, 5)),
                offset=0.2, power=float(r.choice([1.0, 2.0])),
            )
        )  # fmt: skip
    made = System(bodies=bodies, members=members, loads=(Load(body="0", force=(1.0, 2.0), point=(0.1, 0.0)),))
    return with_pin(made, 0.05) if joints else made


def with_pin(system, x):
    """Body 1 pinned to the ground at (x, 0) of its frame, and tied to body 0 by a rod."""
    px, py, angle = system.bodies[1].position
    rod = DistanceJoint(a="0", b="1", point_a=(0.1, 0.1), point_b=(-0.1, 0.0))
    at = (px + x * np.cos(angle), py + x * np.sin(angle))
    return replace(system, joints=(RevoluteJoint(a="1", b="ground", point_a=(x, 0.0), point_b=at), rod))


def changed_body(system, **fields):
    return replace(system, bodies=(replace(system.bodies[0], **fields), *system.bodies[1:]))


def changed_member(system, i, **fields):
    own = system.members
    return replace(system, members=(*own[:i], replace(own[i], **fields), *own[i + 1 :]))


def some_parameters(s):
    """Of every sort: name -> value and system; by the rod's length when the start moves."""
    m, body = s.members[3], s.bodies[0]
    chosen = {
        "stiffness": (m.law.k, lambda x: changed_member(s, 3, law=replace(m.law, k=x))),
        "point": (m.point_a[0], lambda x: changed_member(s, 3, point_a=(x, m.point_a[1]))),
        "mass": (body.mass, lambda x: changed_body(s, mass=x)),
        "load": (2.0, lambda x: replace(s, loads=(replace(s.loads[0], force=(1.0, x)),))),
    }
    if s.joints:
        return chosen | {"pin": (0.05, lambda x: with_pin(s, x))}
    first, second = body.position[0], body.velocity[2]
    return chosen | {
        "place": (first, lambda x: changed_body(s, position=(x, *body.position[1:]))),
        "spin": (second, lambda x: changed_body(s, velocity=(*body.velocity[:2], x))),
    }


def check(system, scheme, objective, parameters, within, *, t_end=0.3, steps=30):
    density = np.linspace(0.5, 1.0, len(system.members))
    run = simulate(system, density, t_end=t_end, steps=steps, scheme=scheme)
    found = parameter_slopes(run, objective, parameters)
    for name, (x, at) in parameters.items():

        def value(y, at=at):
            return objective.value(simulate(at(y), density, t_end=t_end, steps=steps, scheme=scheme))

        exact = quotient(value, x)
        assert found[name] == pytest.approx(exact, rel=within, abs=1e-11), name
    return run, found


def against_the_record(run, found):
    """`parameter_gradient` of the same run says the same."""
    own = parameter_gradient(run, END)
    for name, slope in (("stiffness", own.law[0, 3]), ("point", own.point_a[3, 0]), ("mass", own.mass[0])):
        assert slope == pytest.approx(found[name], rel=SAME, abs=1e-13), name


@pytest.mark.parametrize("joints", [True, False])
@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), BDF2()], ids=["alpha", "BDF2"])
@pytest.mark.parametrize("seed", [1, 2])
def test_slopes_by_every_sort_of_parameter(scheme, joints, seed):
    system = sprung_bodies(seed, joints=joints)
    run, found = check(system, scheme, END, some_parameters(system), EXACT)
    against_the_record(run, found)


@pytest.mark.slow
@pytest.mark.parametrize("joints", [True, False])
@pytest.mark.parametrize("scheme", [IndependentAlpha(rho=0.9), RungeKutta8()], ids=["alpha", "order 8"])
@pytest.mark.parametrize("seed", [3, 4])
def test_slopes_in_independent_coordinates(scheme, joints, seed):
    system = sprung_bodies(seed, joints=joints)
    run, found = check(system, scheme, END, some_parameters(system), EXACT)
    against_the_record(run, found)


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), BDF2()], ids=["alpha", "BDF2"])
def test_slopes_by_parameters_of_a_users_law(scheme):
    base = sprung_bodies(7, joints=True)

    def system(k):
        law = UserLaw(
            force=lambda delta, rate, t, k: k * np.tanh(3.0 * delta) + 2.0 * rate, parameters={"k": k}
        )
        return changed_member(changed_member(base, 0, law=law), 5, law=law)

    check(system(90.0), scheme, END, {"k": (90.0, system)}, EXACT)


BREAKING = {
    "k": 800.0, "c": 3.0, "cap": 60.0, "slip": 0.02, "release": 0.06, "tau": 0.03, "width": 0.01, "hold": 1.0,
}  # fmt: skip


@pytest.mark.parametrize("joints", [True, False])
def test_slopes_across_the_damage_of_bushings(joints):
    """Through the force and through the growth of the damage, to an end after one of two has let go."""
    base = sprung_bodies(11, joints=joints)
    if not joints:
        base = replace(base, bodies=tuple(replace(b, velocity=(0.9, -0.5, 0.4)) for b in base.bodies))

    def system(**changed):
        breaking = Bushing(
            a="0", b="ground", point_a=(0.1, 0.2), point_b=base.bodies[0].position[:2], **BREAKING | changed
        )
        other = Bushing(a="2", b="1", k=400.0, c=1.0, slip=0.1, release=0.3)
        return replace(base, bushings=(breaking, other))

    chosen = {name: (value, lambda x, name=name: system(**{name: x})) for name, value in BREAKING.items()}
    made = system()
    chosen["mass"] = (made.bodies[0].mass, lambda x: changed_body(made, mass=x))
    chosen["stiffness"] = (
        made.members[3].law.k, lambda x: changed_member(made, 3, law=replace(made.members[3].law, k=x))
    )  # fmt: skip
    run, found = check(made, GeneralisedAlpha(), END, chosen, 1e-6, steps=150)
    assert run.states[-1, 0] > 0.5  # it does let go
    own = parameter_gradient(run, END)
    assert own.bushing[0, 0] == pytest.approx(found["k"], rel=SAME)
    assert own.law[0, 3] == pytest.approx(found["stiffness"], rel=SAME)


def test_systems_of_another_structure_are_refused():
    system = sprung_bodies(1, joints=True)
    run = simulate(system, system.density(1.0), t_end=0.1, steps=5)
    free = replace(system, joints=())
    with pytest.raises(ValueError, match="same bodies, joints and elements at every value"):
        parameter_slopes(run, END, {"pin": (0.05, lambda x: free)})

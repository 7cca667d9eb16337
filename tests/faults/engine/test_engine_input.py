"""What an engineer may get wrong: every message names the argument, what was expected and what to do."""

import re
from dataclasses import replace

import numpy as np
import pytest

from studies import two_body
from workbench.engine import (
    Airbag,
    AssemblyError,
    AtTime,
    Belt,
    Body,
    Bushing,
    Contact,
    Coordinate,
    DistanceJoint,
    DrivenJoint,
    GeneralisedAlpha,
    Impulse,
    InvalidSystem,
    JointSpring,
    Load,
    Maximum,
    Member,
    NotConverged,
    NotSupported,
    PNorm,
    PrismaticJoint,
    RevoluteJoint,
    Scalar,
    Spring,
    System,
    Terminal,
    assembled,
    gradient,
    motion_from_acceleration,
    simulate,
)

BODY = Body(name="a", mass=1.0, inertia=1.0)
TIE = Member(a="a", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))


def test_bodies():
    for bad in ({"mass": 0.0}, {"mass": -1.0}, {"inertia": 0.0}):
        with pytest.raises(InvalidSystem, match="body 'a' needs mass > 0 kg and inertia > 0"):
            System(bodies=(replace(BODY, **bad),))
    with pytest.raises(InvalidSystem, match="two bodies are called 'a'"):
        System(bodies=(BODY, BODY))
    with pytest.raises(InvalidSystem, match="may not be called 'ground'"):
        System(bodies=(replace(BODY, name="ground"),))
    with pytest.raises(InvalidSystem, match="at least one body that moves freely"):
        System(bodies=())


def test_parts_on_unknown_bodies():
    with pytest.raises(InvalidSystem, match=re.escape("members[1] refers to body 'b'")):
        System(bodies=(BODY,), members=(TIE, replace(TIE, b="b")))
    with pytest.raises(InvalidSystem, match=re.escape("joints[0] refers to body 'b'")):
        System(bodies=(BODY,), joints=(RevoluteJoint(a="a", b="b"),))
    with pytest.raises(InvalidSystem, match=re.escape("springs[0] joins body 'a' to itself")):
        System(bodies=(BODY,), springs=(JointSpring(a="a", b="a"),))
    with pytest.raises(InvalidSystem, match=re.escape("loads[0] acts on body 'b'")):
        System(bodies=(BODY,), loads=(Load(body="b"),))
    with pytest.raises(ValueError, match="no free body 'b'; free bodies are a"):
        System(bodies=(BODY,)).coordinate("b")


def test_laws_and_elements():
    with pytest.raises(ValueError, match="0 < cap < length"):
        Airbag(cap=0.15)
    with pytest.raises(ValueError, match="0 <= onset < cap"):
        Airbag(onset=0.2)
    with pytest.raises(ValueError, match="width > 0 and rise > 0"):
        Airbag(rise=0.0)
    with pytest.raises(ValueError, match="0 < width <= knee"):
        Belt(width=0.0)
    with pytest.raises(ValueError, match="contact needs width > 0"):
        Contact(k=1.0, width=0.0)
    with pytest.raises(ValueError, match="side="):
        Contact(k=1.0, side=2)
    with pytest.raises(ValueError, match="sigma >= 0"):
        Impulse(f0=1.0, sigma=-1.0, t0=0.0)
    with pytest.raises(ValueError, match="both slip and release"):
        Bushing(a="a", b="ground", k=1.0, slip=0.1)
    with pytest.raises(ValueError, match="0 <= slip < release"):
        Bushing(a="a", b="ground", k=1.0, slip=0.1, release=0.1)
    with pytest.raises(ValueError, match="cap > 0 N"):
        Bushing(a="a", b="ground", k=1.0, cap=0.0)
    with pytest.raises(ValueError, match="tau, width and eps > 0"):
        Bushing(a="a", b="ground", k=1.0, eps=0.0)
    with pytest.raises(ValueError, match="needs both opens and push_cap, or neither"):
        Bushing(a="a", b="ground", k=1.0, cap=2.0, opens=(1.0, 0.0))
    with pytest.raises(ValueError, match="needs cap > 0 N and push_cap > 0 N together, got cap=None"):
        Bushing(a="a", b="ground", k=1.0, opens=(1.0, 0.0), push_cap=3.0)
    with pytest.raises(ValueError, match=r"needs a direction opens, got \(0.0, 0.0\)"):
        Bushing(a="a", b="ground", k=1.0, cap=2.0, opens=(0.0, 0.0), push_cap=3.0)
    with pytest.raises(ValueError, match="width > 0 rad"):
        JointSpring(a="a", b="ground", width=0.0)
    with pytest.raises(ValueError, match="upper and lower >= 0"):
        JointSpring(a="a", b="ground", lower=-0.1)
    with pytest.raises(ValueError, match="'angle' or 'along'"):
        DrivenJoint(a="a", b="ground", motion=lambda t: 0.0, coordinate="x")
    with pytest.raises(ValueError, match="needs a direction"):
        PrismaticJoint(a="a", b="ground", axis=(0.0, 0.0)).rows()
    with pytest.raises(ValueError, match="0 <= rho <= 1"):
        GeneralisedAlpha(rho=1.2)
    with pytest.raises(ValueError, match="increasing times"):
        motion_from_acceleration(np.array([0.0, 0.0]), np.zeros((2, 3)))


def test_runs():
    system = System(bodies=(BODY,), members=(TIE,))
    for t_end in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="needs t_end > 0 s"):
            simulate(system, [1.0], t_end, 10)
    with pytest.raises(ValueError, match="steps >= 1, got steps=0"):
        simulate(system, [1.0], 1.0, 0)
    with pytest.raises(ValueError, match=re.escape("shape (1,), got shape (2,)")):
        simulate(system, [1.0, 1.0], 1.0, 10)
    for bad in (-0.1, np.nan):
        with pytest.raises(ValueError, match=re.escape("density[0]=")):
            simulate(system, [bad], 1.0, 10)
    run = simulate(system, [1.0], 1.0, 10)
    with pytest.raises(ValueError, match="window needs 0 <= start < end"):
        Maximum(quantity=Coordinate(bodies=("a",)), window=(2.0, 3.0)).value(run)
    with pytest.raises(ValueError, match="time needs to lie in the run"):
        AtTime(quantity=Coordinate(bodies=("a",)), time=2.0).value(run)
    with pytest.raises(ValueError, match="p >= 1"):
        PNorm(quantity=Coordinate(bodies=("a",)), p=0.5).value(run)
    with pytest.raises(ValueError, match="quantity refers to body 'z'"):
        Terminal(quantity=Coordinate(bodies=("z",))).value(run)
    nothing = Scalar(function=lambda t, q, v, w, density: np.nan)
    with pytest.raises(ValueError, match="not finite along the trajectory"):
        Maximum(quantity=nothing).value(run)
    with pytest.raises(NotSupported, match="no time derivative"):
        nothing.rates(run, np.array([0]))
    with pytest.raises(NotSupported, match="no time derivative"):
        nothing.rate_slopes(run, 0)


def test_a_start_that_misses_the_joints_comes_with_its_correction():
    system = System(
        bodies=(replace(BODY, position=(1.01, 0.0, 0.0)),),
        joints=(RevoluteJoint(a="a", b="ground", point_a=(-1.0, 0.0)),),
    )
    with pytest.raises(AssemblyError, match=r"off by 0.01 .* move a coordinate by up to 0.01") as caught:
        simulate(system, [], 0.1, 10)
    assert caught.value.size == pytest.approx(0.01)
    fixed = assembled(system)
    assert simulate(fixed, [], 0.1, 10).joint_residuals() == pytest.approx(0.0, abs=1e-12)
    moving = replace(fixed, bodies=(replace(fixed.bodies[0], velocity=(1.0, 0.0, 0.0)),))
    with pytest.raises(AssemblyError, match="initial velocities do not satisfy"):
        simulate(moving, [], 0.1, 10)
    simulate(assembled(moving), [], 0.1, 10)


def test_joints_that_contradict_each_other_are_named():
    system = System(
        bodies=(BODY,),
        joints=(
            DistanceJoint(a="a", b="ground", point_b=(1.0, 0.0), length=1.0),
            DistanceJoint(a="a", b="ground", point_b=(9.0, 0.0), length=1.0, name="too far"),
        ),
    )
    with pytest.raises(AssemblyError, match="joints contradict each other: 'too far, row 0'"):
        simulate(system, [], 0.1, 10)
    with pytest.raises(AssemblyError, match="joints contradict each other"):
        assembled(system)
    with pytest.raises(InvalidSystem, match="needs a length > 0 m"):
        simulate(System(bodies=(BODY,), joints=(DistanceJoint(a="a", b="ground"),)), [], 0.1, 10)


def test_a_step_that_is_too_large_is_told_which_one_would_do():
    mass = replace(BODY, position=(0.5, 0.0, 0.0))
    hard = Member(
        a="a", b="ground", law=Contact(k=1e7, side=-1, width=1e-4), natural_length=0.2,
    )  # fmt: skip
    system = System(bodies=(replace(mass, velocity=(-30.0, 0.1, 0.0)),), members=(hard,))
    with pytest.raises(NotConverged, match=r"stopped at t = 0.025 s .*(use steps=\d+|No step down to)"):
        simulate(system, [1.0], 0.1, 8, scheme=GeneralisedAlpha(iterations=3))


def test_coincident_points_and_zero_densities_give_numbers():
    member = Member(a="a", b="ground", law=Spring(k=10.0))
    system = System(bodies=(BODY,), members=(member, TIE))
    run = simulate(system, [1.0, 0.0], 0.2, 20)
    found = gradient(system, [1.0, 0.0], run, Terminal(quantity=Coordinate(bodies=("a",))))
    assert np.isfinite(run.position).all()
    assert np.isfinite(found).all()


def test_studies_name_their_cases():
    with pytest.raises(ValueError, match="one of A, B, C, got 'D'"):
        two_body.problem("D")
    with pytest.raises(ValueError, match="one of short, long, energy"):
        two_body.layout_problem("A")
    with pytest.raises(ValueError, match="'node' or 'refined'"):
        two_body.layout_problem("short", peak="x")


def test_what_is_no_system_is_refused_by_name():
    with pytest.raises(TypeError, match="needs a system of one of the kinds System, NaturalSystem"):
        simulate("a system", [1.0], t_end=0.1, steps=2)

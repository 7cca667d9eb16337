"""Random trees of rigid bodies with every kind of joint and force."""

import numpy as np
import pytest

from workbench.engine import Belt, Contact, Spring
from workbench.engine.errors import InvalidSystem
from workbench.engine.integration.schemes import GeneralisedAlpha
from workbench.engine.tree import compiled
from workbench.engine.tree.compiled import tree_compiled
from workbench.engine.tree.elements import (
    CoordinateDamper,
    CoordinateSpring,
    Coupling,
    SpatialBushing,
    SpatialLoad,
    SpatialMember,
    SphericalSpring,
)
from workbench.engine.tree.joints import (
    Cylindrical,
    Floating,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
    Welded,
)
from workbench.engine.tree.runs import run
from workbench.engine.tree.surfaces import Box, Capsule, Plane, Ring, Road, SpatialContact, Sphere, Tyre
from workbench.engine.tree.system import SpatialBody, TreeSystem

# Pacejka 1989 in the order of the formula, of the size of a light truck's tyre
LATERAL = (1.5, -4.8, 810.0, 2600.0, 49.0, 0.0, -0.009, 0.38)
LONGITUDINAL = (1.5, -16.0, 1020.0, -2.5, 209.0, 0.007, -0.004, 0.16, -1.15)


@pytest.fixture(autouse=True)
def one_set_of_kernels(monkeypatch):
    """Compile trees as if they held every element: a set of kernels for each mixture would take minutes."""
    monkeypatch.setattr(compiled, "MAY_BE_ABSENT", ())


def tree_run(system, density, times, scheme=None, **options):
    """The run of a tree on a grid of its own."""
    return run(system, density, times, GeneralisedAlpha() if scheme is None else scheme, **options)


def _triple(rng):
    return tuple(float(x) for x in rng.normal(size=3))


def _axes(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def _joint(kind, rng):
    turn, a, b = tuple(rng.normal(size=4)), _triple(rng), _triple(rng)
    speeds = rng.normal(size=4)
    return (
        Floating(position=a, orientation=turn, velocity=b, spin=_triple(rng)),
        Spherical(orientation=turn, spin=a),
        Universal(axes=(a, b), angles=(0.3, 0.4), speeds=(speeds[0], speeds[1])),
        Revolute(axis=a, angle=0.5, speed=speeds[0]),
        Prismatic(axis=a, position=0.2, speed=speeds[0]),
        Cylindrical(axis=a, position=0.2, angle=0.4, speed=speeds[0], angular_speed=speeds[1]),
        Planar(position=(0.2, 0.3), angle=0.4, velocity=(speeds[0], speeds[1]), angular_speed=speeds[2]),
        Welded(),
    )[kind]


def random_bodies(count, rng, *, first=0):
    """Bodies b0, b1, ... on random joints; b0 on the ground with the joint number `first`."""
    bodies = []
    for i in range(count):
        turn = _axes(rng)
        bodies.append(
            SpatialBody(
                name=f"b{i}", parent="ground" if i == 0 else f"b{int(rng.integers(0, i))}",
                joint=_joint(first if i == 0 else int(rng.integers(0, 8)), rng), at=_triple(rng),
                axes=_axes(rng), mass=float(rng.uniform(0.5, 3.0)), centre=tuple(0.3 * rng.normal(size=3)),
                inertia=turn @ np.diag(rng.uniform(0.5, 1.0, 3)) @ turn.T,
            )
        )  # fmt: skip
    return tuple(bodies)


def _members(names, rng):
    laws = (
        Spring(k=80.0, c=3.0), Belt(k1=200.0, k2=60.0, knee=0.1, width=0.05, c=2.0),
        Contact(k=100.0, c=1.0, gap=-0.2, width=0.3),
    )  # fmt: skip
    for i in range(12):
        a, b = rng.choice(len(names), 2, replace=False)
        yield SpatialMember(
            a=names[a], b=names[b], point_a=_triple(rng), point_b=_triple(rng), law=laws[i % 3],
            natural_length=1.0, power=1.0 + i % 2,
        )  # fmt: skip


def _bushings(names, rng):
    breaks = {"cap": 50.0, "slip": 0.5, "release": 4.0, "width": 0.5, "tau": 0.1}
    kinds = ({}, {"cap": 100.0}, breaks, {**breaks, "opens": (1.0, 2.0, 0.0), "push_cap": 80.0})
    for kind in kinds:
        a, b = rng.choice(len(names), 2, replace=False)
        yield SpatialBushing(
            a=names[a], b=names[b], point_a=_triple(rng), point_b=_triple(rng), k=(50.0, 70.0, 40.0),
            c=(1.0, 2.0, 3.0), preload=(3.0, 1.0, 2.0), **kind,
        )  # fmt: skip


def _contacts(names, rng):
    shapes = (
        Plane(normal=(0.2, 0.1, 1.0), offset=-1.0), Sphere(centre=(0.1, 0.2, 0.0), radius=1.5),
        Capsule(start=(-1.0, 0.0, 0.2), end=(1.0, 0.5, 0.0), radius=1.0),
        Ring(centre=(0.0, 0.1, 0.0), axis=(0.1, 0.2, 1.0), radius=1.5, tube=0.8),
        Box(half=(1.0, 0.8, 0.6), rounding=0.3),
    )  # fmt: skip
    for shape in shapes:
        a, b = rng.choice(len(names), 2, replace=False)
        yield SpatialContact(
            a=names[a], b=names[b], point=_triple(rng), radius=1.0, shape=shape, k=50.0, damping=0.2,
            width=0.2, friction=0.5, slow=0.3,
        )  # fmt: skip


def random_tree(rng, *, count=6, first=0, elements=True):
    """A tree with every kind of element, or with none."""
    while True:
        bodies = random_bodies(count, rng, first=first)
        if not elements:
            return TreeSystem(bodies=bodies)
        names = [body.name for body in bodies] + ["ground"]
        moving = [body.name for body in bodies if not isinstance(body.joint, Welded)]
        single = [body.name for body in bodies if isinstance(body.joint, Revolute | Prismatic | Universal)]
        balls = [body.name for body in bodies if isinstance(body.joint, Spherical | Floating)]
        some = TreeSystem(
            bodies=bodies,
            members=tuple(_members(names, rng)),
            bushings=tuple(_bushings([*moving, "ground"], rng)),
            springs=tuple(
                CoordinateSpring(
                    body=name, k=5.0, c=1.0, k_stop=30.0, upper=0.1, lower=0.2, width=0.1, torque=0.5
                )
                for name in single
            ),
            dampers=(
                CoordinateDamper(body=single[0], forward=2.0, backward=5.0, slow=0.3),
                CoordinateDamper(body=single[-1], friction=lambda t: 1.0 + t, slow=0.5),
            )
            if single
            else (),
            spherical_springs=tuple(SphericalSpring(body=name, k=5.0, c=1.0) for name in balls),
            couplings=(Coupling(a=single[0], b=single[-1], k=20.0, c=0.3),) if len(single) > 1 else (),
            contacts=tuple(_contacts(names, rng)),
            tyres=(
                Tyre(
                    body=moving[0],
                    radius=2.0,
                    stiffness=40.0,
                    damping=9.0,
                    nominal_load=60.0,
                    width=0.5,
                    lateral=LATERAL,
                    longitudinal=LONGITUDINAL,
                    friction=0.7,
                    slow=0.5,
                    rolling_resistance=0.02,
                    road=Road(
                        amplitude=0.1,
                        wavelength=3.0,
                        heading=0.3,
                        start=-20.0,
                        kerb_height=0.2,
                        kerb_width=4.0,
                        waves=((0.05, 2.0, 0.4), (0.03, 1.3, -1.0)),
                    ),
                ),
            ),
            loads=(
                SpatialLoad(body="b1", force=lambda t: (1.0 + t, 2.0, 3.0), point=(0.1, 0.2, 0.3)),
                SpatialLoad(body="b2", force=(1.0, 2.0, 3.0), point=(0.1, 0.2, 0.3), follows=True),
                SpatialLoad(body="b3", torque=(1.0, 2.0, 3.0)),
                SpatialLoad(body=names[0], torque=lambda t: (1.0, 2.0 * t, 3.0), follows=True),
            ),
        )
        try:
            tree_compiled(some)
        except (InvalidSystem, ValueError):
            continue  # an element fell between two bodies welded together
        return some

"""Spatial mechanisms for the tests: Bricard's (IFToMM A04), the stiff governor (A05), the heavy top."""

import numpy as np

from workbench.engine import (
    NaturalPoint,
    NaturalSystem,
    PointMember,
    PointOnLine3,
    RigidElement,
    Spring,
    UnitVector,
    moving,
)


def bricard():
    """Five 1 m rods of 1 kg and 0.1 m x 0.1 m, six revolute joints with axes y, z, x, y, z, x."""
    places = [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)]
    axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
    ends = (0, 5)
    points = [NaturalPoint(name=f"P{i}", position=p, fixed=i in ends) for i, p in enumerate(places)]
    vectors = [UnitVector(name=f"u{i}", direction=a, fixed=i in ends) for i, a in enumerate(axes)]
    rods = []
    for i in range(5):
        d = np.array(places[i + 1], float) - places[i]
        along = np.outer(d, d)
        rods.append(
            RigidElement(
                name=f"rod {i + 1}", points=(f"P{i}", f"P{i + 1}"), vectors=(f"u{i}", f"u{i + 1}"), mass=1.0,
                inertia=(1.01 * (np.eye(3) - along) + 0.02 * along) / 12,
            )
        )  # fmt: skip
    return NaturalSystem(points=points, vectors=vectors, elements=rods, gravity=(0.0, -9.81, 0.0))


def governor():
    """Shaft and rods 1 x 0.01 x 0.01 m, slider a 0.1 m cube, 3000 kg/m^3, 5 kg at the tips, 2 pi rad/s."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    slim = 0.3 * (1.0 + 1e-4) / 12
    points = [
        NaturalPoint(name="O", position=(0, 0, 0), fixed=True),
        NaturalPoint(name="S", position=(0, 0, 0.5)),
    ]
    elements = [
        RigidElement(
            name="shaft", points=("O", "T+", "T-"), vectors=("x", "y", "z"), mass=0.3, centre=(0, 0, 0.5),
            inertia=np.diag([slim, slim, 0.3 * 2e-4 / 12]),
        ),
        RigidElement(
            name="slider", points=("S", "S+", "S-"), vectors=("x", "y", "z"), mass=3.0, centre=(0, 0, 0.5),
            inertia=np.eye(3) * 3.0 * 0.02 / 12,
        ),
    ]  # fmt: skip
    for sign, side in ((1.0, "+"), (-1.0, "-")):
        down = np.array([sign * c, 0.0, -s])
        top = np.array([sign * 0.05, 0.0, 1.0])
        points += [
            NaturalPoint(name=f"T{side}", position=tuple(top)),
            NaturalPoint(name=f"C{side}", position=tuple(top + 0.5 * down)),
            NaturalPoint(name=f"B{side}", position=tuple(top + down), mass=5.0),
            NaturalPoint(name=f"S{side}", position=(sign * 0.05, 0.0, 0.5)),
        ]
        along = np.outer(down, down)
        elements.append(
            RigidElement(
                name=f"rod{side}", points=(f"T{side}", f"B{side}", f"C{side}"), vectors=("y",), mass=0.3,
                centre=tuple(top + 0.5 * down), inertia=slim * (np.eye(3) - along) + 0.3 * 2e-4 / 12 * along,
            )
        )  # fmt: skip
    vectors = [
        UnitVector(name="x", direction=(1, 0, 0)),
        UnitVector(name="y", direction=(0, 1, 0)),
        UnitVector(name="z", direction=(0, 0, 1), fixed=True),
    ]
    still = NaturalSystem(
        points=points, vectors=vectors, elements=elements,
        conditions=(PointOnLine3(point="S", origin="O", axis="z", name="slide"),),
        members=tuple(
            PointMember(a=f"S{side}", b=f"C{side}", law=Spring(k=8e5, c=4e4), natural_length=0.5)
            for side in "+-"
        ),
        gravity=(0.0, 0.0, -9.81),
    )  # fmt: skip
    spin = np.array([0.0, 0.0, 2 * np.pi])
    known = {p.name: tuple(np.cross(spin, p.position)) for p in points if not p.fixed}
    return moving(still, known | {"x": (0.0, 2 * np.pi, 0.0), "y": (-2 * np.pi, 0.0, 0.0)})


def heavy_top():
    """Bruls, Cardona and Arnold: m 15, J diag(0.234375, 0.46875, 0.234375), Omega (0, 150, -4.61538)."""
    omega = np.array([0.0, 150.0, -4.61538])
    axes = {name: tuple(row) for name, row in zip("xyz", np.eye(3), strict=True)}
    vectors = [UnitVector(name=n, direction=d, rate=tuple(np.cross(omega, d))) for n, d in axes.items()]
    top = RigidElement(
        name="top", points=("O",), vectors=("x", "y", "z"), mass=15.0, centre=(0, 1, 0),
        inertia=np.diag([0.234375, 0.46875, 0.234375]),
    )  # fmt: skip
    points = (NaturalPoint(name="O", position=(0, 0, 0), fixed=True),)
    return NaturalSystem(points=points, vectors=vectors, elements=(top,), gravity=(0.0, 0.0, -9.81))

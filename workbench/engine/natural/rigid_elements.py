"""Rigid elements in natural coordinates: their frame, rigid-body conditions and constant mass matrix.

With P_0 and three directions d (points less P_0, or unit vectors) every material point is r = P_0 + D c, so
its position is sum_k phi_k X_k over the nodes X_k with phi affine in c, and the mass matrix is m_kl = int
phi_k phi_l dm."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidSystem
from .system import NaturalSystem, RigidElement, UnitVector

__all__ = ["Frame", "completed", "frame_of", "node_mass"]

Array = np.ndarray[Any, Any]

FLAT = 0.05  # a direction nearer than this (sine) to the others adds nothing
SLENDER = 1e-9  # of the largest second moment: what lies outside the frame and is left out


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """Nodes that span an element: names of the directions, whether each is a point, D (3, k) at the start."""

    origin: str
    names: tuple[str, ...]
    is_point: tuple[bool, ...]
    directions: Array


def places(system: NaturalSystem) -> dict[str, Array]:
    """Starting positions of points and directions of unit vectors (of length 1)."""
    out = {p.name: np.array(p.position, float) for p in system.points}
    for vector in system.vectors:
        d = np.array(vector.direction, float)
        out[vector.name] = d / np.linalg.norm(d)
    return out


def frame_of(system: NaturalSystem, element: RigidElement) -> Frame:
    """Pick up to three well-spread directions, points first."""
    at = places(system)
    origin = element.points[0]
    names: list[str] = []
    flags: list[bool] = []
    columns: list[Array] = []
    basis = np.zeros((0, 3))
    for name, point in [(p, True) for p in element.points[1:]] + [(u, False) for u in element.vectors]:
        d = at[name] - at[origin] if point else at[name]
        size = float(np.linalg.norm(d))
        if size == 0.0:
            raise InvalidSystem(f"element '{element.name}': points '{origin}' and '{name}' coincide")
        rest = d / size - basis.T @ (basis @ (d / size))
        if len(names) < 3 and np.linalg.norm(rest) > FLAT:
            names.append(name)
            flags.append(point)
            columns.append(d)
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
    directions = np.array(columns).T if columns else np.zeros((3, 0))
    return Frame(origin=origin, names=tuple(names), is_point=tuple(flags), directions=directions)


def second_moment(system: NaturalSystem, element: RigidElement) -> tuple[Array, Array]:
    """Centre (3,) and int r r^T dm about it (3, 3) at the start."""
    at = places(system)
    centre = np.mean([at[p] for p in element.points], axis=0)
    if element.centre is not None:
        centre = np.array(element.centre, float)
    inertia = np.zeros((3, 3)) if element.inertia is None else np.array(element.inertia, float)
    if inertia.shape != (3, 3) or not np.allclose(inertia, inertia.T, atol=1e-12 * np.abs(inertia).max()):
        raise InvalidSystem(
            f"element '{element.name}' needs a symmetric inertia of shape (3, 3), got {inertia}"
        )
    spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    least = float(np.linalg.eigvalsh(spread)[0])
    if least < -1e-9 * max(float(np.trace(inertia)), 1e-300):
        raise InvalidSystem(
            f"element '{element.name}' has an inertia no body can have: one moment exceeds the sum of the "
            "other "
            f"two by {-2 * least:.3g} kg m^2"
        )
    return centre, spread


def completed(system: NaturalSystem) -> NaturalSystem:
    """The system with the unit vectors that its elements need and lack, 'element: direction 1' and so on."""
    at = places(system)
    moving = {p.name: np.array(p.velocity, float) for p in system.points}
    moving |= {u.name: np.array(u.rate, float) for u in system.vectors}
    vectors, elements = list(system.vectors), []
    for element in system.elements:
        frame = frame_of(system, element)
        if element.mass == 0.0 or len(frame.names) == 3:
            elements.append(element)
            continue
        centre, spread = second_moment(system, element)
        arm = centre - at[frame.origin]
        needed = spread + element.mass * np.outer(arm, arm)
        q, _ = np.linalg.qr(np.hstack([frame.directions, np.eye(3)]))
        outside = q[:, len(frame.names) : 3]
        rest = outside.T @ needed @ outside
        if np.abs(rest).max(initial=0.0) <= SLENDER * max(float(np.trace(needed)), 1e-300):
            elements.append(element)
            continue
        rates = np.array(
            [
                moving[n] - moving[frame.origin] if p else moving[n]
                for n, p in zip(frame.names, frame.is_point, strict=True)
            ]
        ).reshape(-1, 3)
        turn = _turning(frame.directions.T, rates)
        added = []
        for k, direction in enumerate(outside.T):
            name = f"{element.name}: direction {k + 1}"
            d = tuple(float(x) for x in direction)
            rate = tuple(float(x) for x in np.cross(turn, direction))
            vectors.append(UnitVector(name=name, direction=d, rate=rate))  # type: ignore[arg-type]
            added.append(name)
        elements.append(
            RigidElement(
                name=element.name, points=element.points, vectors=(*element.vectors, *added),
                mass=element.mass, centre=element.centre, inertia=element.inertia,
            )
        )  # fmt: skip
    return NaturalSystem(
        points=system.points, vectors=tuple(vectors), elements=tuple(elements), conditions=system.conditions,
        members=system.members, gravity=system.gravity,
    )  # fmt: skip


def _turning(directions: Array, rates: Array) -> Array:
    """Smallest angular velocity with omega x d = d' for all directions (k, 3)."""
    rows = [np.array([[0, d[2], -d[1]], [-d[2], 0, d[0]], [d[1], -d[0], 0]]) for d in directions]
    if not rows:
        return np.zeros(3)
    return np.asarray(np.linalg.lstsq(np.vstack(rows), rates.ravel(), rcond=1e-12)[0])


def node_mass(system: NaturalSystem, element: RigidElement) -> tuple[tuple[str, ...], Array, Array]:
    """Node names, their mass matrix (k, k) and int phi dm (k,): times 3 x 3 unit, and times gravity."""
    frame = frame_of(system, element)
    centre, spread = second_moment(system, element)
    inverse = np.linalg.pinv(frame.directions)
    arm = inverse @ (centre - places(system)[frame.origin])
    k = len(frame.names)
    moments = np.zeros((k + 1, k + 1))
    moments[0, 0] = element.mass
    moments[0, 1:] = moments[1:, 0] = element.mass * arm
    moments[1:, 1:] = inverse @ spread @ inverse.T + element.mass * np.outer(arm, arm)
    shape = np.eye(k + 1)  # phi = shape (1, c)
    shape[0, 1:] = -np.array(frame.is_point, float)
    return (frame.origin, *frame.names), shape @ moments @ shape.T, shape @ moments[:, 0]

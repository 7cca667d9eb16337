"""From a `NaturalSystem` to the flat tables of the kernels: coordinates, constraints, mass, members."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary, ref

import numpy as np

from ..compiler.owned_tables import OwnedTables
from ..elements.laws import UserLaw
from ..elements.prescribed_motion import _slope
from ..elements.table import PARAMETERS
from ..errors import InvalidSystem
from ..integration.chart import Rates
from .rigid_elements import (
    Frame,
    completed,
    frame_of,
    node_mass,
    places,
)
from .system import (
    Angle,
    Condition,
    Distance,
    NaturalSystem,
    PointOnLine3,
    PointOnPlane,
    RigidElement,
)
from .tables import NaturalTables

__all__ = ["Compiled", "compiled", "on_grid", "rates_of"]

Array = np.ndarray[Any, Any]
Term = list[tuple[str, float]]  # a linear combination of nodes

AFFINE = 1e-9  # m: how well further points of an element follow its frame


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compiled(OwnedTables[NaturalSystem]):
    """The time-independent tables of a system; `system` is the given one, `full` has added directions."""

    full: NaturalSystem
    index: dict[str, int]  # first coordinate of every node, free nodes first
    arrays: dict[str, Array]
    row_names: tuple[str, ...]
    drives: tuple[Callable[[float], float] | None, ...]
    order: Array  # (N,) member number at each segment position
    power: Array  # (N,) in member order
    start: tuple[Array, Array]


_CACHE: WeakKeyDictionary[NaturalSystem, Compiled] = WeakKeyDictionary()


def compiled(system: NaturalSystem) -> Compiled:
    """The compiled tables, built on first use."""
    found = _CACHE.get(system)
    if found is None:
        found = _CACHE[system] = _compile(system)
    return found


@dataclass(slots=True)
class _Rows:
    """Constraint rows as they are collected."""

    index: dict[str, int]
    free: int
    at: dict[str, Array]
    names: list[str] = field(default_factory=list)
    drives: list[Callable[[float], float] | None] = field(default_factory=list)
    constant: list[float] = field(default_factory=list)
    product: list[tuple[int, int, int]] = field(default_factory=list)
    product_value: list[float] = field(default_factory=list)
    linear: list[tuple[int, int]] = field(default_factory=list)
    linear_value: list[float] = field(default_factory=list)
    said: set[Any] = field(default_factory=set)

    def moves(self, *terms: Term) -> bool:
        """Whether any node of the terms is free."""
        return any(self.index[name] < self.free for term in terms for name, _ in term)

    def row(self, name: str, constant: float = 0.0, drive: Callable[[float], float] | None = None) -> int:
        """A new row; its constant is subtracted."""
        self.names.append(name)
        self.constant.append(-constant)
        self.drives.append(drive)
        return len(self.names) - 1

    def product_of(self, row: int, one: Term, e: int, two: Term, g: int, scale: float) -> None:
        """Add scale one_e two_g."""
        for a, x in one:
            for b, y in two:
                self.product.append((row, self.index[a] + e, self.index[b] + g))
                self.product_value.append(scale * x * y)

    def dot(self, row: int, one: Term, two: Term, scale: float = 1.0) -> None:
        """Add scale one . two."""
        for e in range(3):
            self.product_of(row, one, e, two, e, scale)

    def value(self, term: Term) -> Array:
        """A combination of nodes at the start."""
        return np.asarray(sum(x * self.at[name] for name, x in term))


def _compile(system: NaturalSystem) -> Compiled:
    full = completed(system)
    nodes = [(p.name, p.fixed, p.velocity) for p in full.points]
    nodes += [(u.name, u.fixed, u.rate) for u in full.vectors]
    nodes = [n for n in nodes if not n[1]] + [n for n in nodes if n[1]]
    index = {name: 3 * i for i, (name, _, _) in enumerate(nodes)}
    n = 3 * sum(not fixed for _, fixed, _ in nodes)
    at = places(full)
    rows = _Rows(index=index, free=n, at=at)
    for vector in full.vectors:
        if not vector.fixed:
            r = rows.row(f"unit length of '{vector.name}'", 0.5)
            rows.dot(r, [(vector.name, 1.0)], [(vector.name, 1.0)], 0.5)
    for element in full.elements:
        _element(rows, element, frame_of(full, element))
    for number, condition in enumerate(full.conditions):
        _condition(rows, condition, condition.name or f"{type(condition).__name__} {number}")
    mass, gravity = _mass(full, index, n)
    order, members = _members(full, index, at)
    q0 = np.concatenate([at[name] for name, fixed, _ in nodes if not fixed])
    v0 = np.concatenate([np.array(v, float) for _, fixed, v in nodes if not fixed])
    held = [at[name] for name, fixed, _ in nodes if fixed]
    arrays = {
        "mass": mass,
        "gravity": gravity,
        "held": np.concatenate(held) if held else np.zeros(0),
        "product": np.array(rows.product, np.int64).reshape(-1, 3),
        "product_value": np.array(rows.product_value, float),
        "linear": np.array(rows.linear, np.int64).reshape(-1, 2),
        "linear_value": np.array(rows.linear_value, float),
        "constant": np.array(rows.constant, float),
        **members,
    }
    return Compiled(
        owner=ref(system), full=full, index=index, arrays=arrays, row_names=tuple(rows.names),
        drives=tuple(rows.drives), order=order, power=np.array([m.power for m in full.members], float),
        start=(q0, v0),
    )  # fmt: skip


def _direction(frame: Frame, k: int) -> Term:
    name = frame.names[k]
    return [(name, 1.0), (frame.origin, -1.0)] if frame.is_point[k] else [(name, 1.0)]


def _element(rows: _Rows, element: RigidElement, frame: Frame) -> None:
    """Inner products of the frame's directions are kept; further nodes follow the frame linearly."""
    sizes = np.linalg.norm(frame.directions, axis=0)
    for i in range(len(frame.names)):
        for j in range(i + 1):
            one, two = _direction(frame, i), _direction(frame, j)
            if i == j and not frame.is_point[i]:
                continue  # of unit length already
            key = frozenset([frozenset(name for name, _ in one), frozenset(name for name, _ in two)])
            if key in rows.said or not rows.moves(one, two):
                continue
            rows.said.add(key)
            scale = 1.0 / np.sqrt(sizes[i] * sizes[j])
            if frame.is_point[i] != frame.is_point[j]:
                scale = 1.0
            if i == j:
                what = f"length {frame.origin}-{frame.names[i]}"
                scale *= 0.5
            else:
                what = f"angle between {frame.names[j]} and {frame.names[i]} from {frame.origin}"
            r = rows.row(f"{element.name}: {what}", scale * float(rows.value(one) @ rows.value(two)))
            rows.dot(r, one, two, scale)
    others = [(p, True) for p in element.points[1:]] + [(u, False) for u in element.vectors]
    for name, is_point in others:
        if name in frame.names or not rows.moves([(name, 1.0)], *([(f, 1.0)] for f in frame.names)):
            continue
        target = rows.at[name] - (rows.at[frame.origin] if is_point else 0.0)
        share = np.linalg.lstsq(frame.directions, target, rcond=None)[0]
        if np.abs(frame.directions @ share - target).max(initial=0.0) > AFFINE:
            raise InvalidSystem(
                f"element '{element.name}': '{name}' lies almost, but not quite, in the directions "
                f"{', '.join(frame.names) or '(none)'} of its other points and vectors. Move it there, or "
                "give the "
                "element another unit vector"
            )
        term: Term = [(name, -1.0)] + ([(frame.origin, 1.0)] if is_point else [])
        for k, x in enumerate(share):
            term += [(node, float(x) * y) for node, y in _direction(frame, k)]
        for e, axis in enumerate("xyz"):
            r = rows.row(f"{element.name}: {axis} of {name} in the frame")
            for node, x in term:
                rows.linear.append((r, rows.index[node] + e))
                rows.linear_value.append(x)


def _condition(rows: _Rows, condition: Condition, label: str) -> None:
    match condition:
        case Distance(a=a, b=b, length=length):
            arm: Term = [(a, 1.0), (b, -1.0)]
            now = float(np.linalg.norm(rows.value(arm)))
            first = length(0.0) if callable(length) else now if length is None else length
            if not first > 0.0:
                raise InvalidSystem(f"{label} needs a length > 0 m, got {first}")
            drive = (lambda t, f=length, s=first: 0.5 * f(t) ** 2 / s) if callable(length) else None
            r = rows.row(label, 0.0 if drive else 0.5 * first, drive)
            rows.dot(r, arm, arm, 0.5 / first)
        case Angle(a=a, b=b, cosine=cosine):
            one, two = [(a, 1.0)], [(b, 1.0)]
            value = float(rows.value(one) @ rows.value(two)) if cosine is None else cosine
            r = rows.row(label, *((0.0, value) if callable(value) else (value, None)))
            rows.dot(r, one, two)
        case PointOnLine3(point=p, origin=o, axis=u):
            arm, axis = [(p, 1.0), (o, -1.0)], [(u, 1.0)]
            for e, name in enumerate("xyz"):
                r = rows.row(f"{label}, {name}")
                rows.product_of(r, arm, (e + 1) % 3, axis, (e + 2) % 3, 1.0)
                rows.product_of(r, arm, (e + 2) % 3, axis, (e + 1) % 3, -1.0)
        case PointOnPlane(point=p, origin=o, normal=u, height=height):
            arm, axis = [(p, 1.0), (o, -1.0)], [(u, 1.0)]
            value = float(rows.value(arm) @ rows.value(axis)) if height is None else height
            r = rows.row(label, *((0.0, value) if callable(value) else (value, None)))
            rows.dot(r, arm, axis)


def _mass(system: NaturalSystem, index: dict[str, int], n: int) -> tuple[Array, Array]:
    """(n, n) mass matrix and (n,) gravity of the free nodes."""
    full = 3 * len(index)
    mass, weight = np.zeros((full, full)), np.zeros(full)
    eye, g = np.eye(3), np.array(system.gravity, float)
    for point in system.points:
        i = index[point.name]
        mass[i : i + 3, i : i + 3] += point.mass * eye
        weight[i : i + 3] += point.mass * g
    for element in system.elements:
        if element.mass == 0.0:
            continue
        names, block, first = node_mass(system, element)
        for a, one in enumerate(names):
            i = index[one]
            weight[i : i + 3] += first[a] * g
            for b, two in enumerate(names):
                j = index[two]
                mass[i : i + 3, j : j + 3] += block[a, b] * eye
    return np.ascontiguousarray(mass[:n, :n]), weight[:n]


def _members(
    system: NaturalSystem, index: dict[str, int], at: dict[str, Array]
) -> tuple[Array, dict[str, Array]]:
    count = len(system.members)
    for i, member in enumerate(system.members):
        if isinstance(member.law, UserLaw):
            raise InvalidSystem(
                f"members[{i}] has a UserLaw, which spatial systems do not take; use CompiledLaw for a "
                "function of your own, or Curve for points of a test"
            )
    order = np.array(sorted(range(count), key=lambda i: (system.members[i].law.code, i)), np.int64)
    ends, length, law = np.zeros((count, 2), np.int64), np.zeros(count), np.zeros((PARAMETERS, count))
    codes = []
    for place, i in enumerate(order):
        member = system.members[i]
        ends[place] = index[member.a], index[member.b]
        now = float(np.linalg.norm(at[member.a] - at[member.b]))
        length[place] = now if member.natural_length is None else member.natural_length
        column = member.law.parameters
        law[: len(column), place] = column
        codes.append(member.law.code)
    segments, first = [], 0
    for last in range(1, count + 1):
        if last == count or codes[last] != codes[first]:
            segments.append((codes[first], first, last))
            first = last
    segment = np.array(segments, np.int64).reshape(-1, 3)
    return order, {"ends": ends, "length": length, "law": law, "segment": segment}


def on_grid(parts: Compiled, density: Array, times: Array) -> NaturalTables:
    """Tables with the drives sampled at `times` and the densities of one design (member order)."""
    drive = np.zeros((len(times), len(parts.drives)))
    for index, function in enumerate(parts.drives):
        if function is not None:
            drive[:, index] = [function(float(t)) for t in times]
    scale = density**parts.power if len(density) else density
    return NaturalTables(
        **parts.arrays,
        scale=np.ascontiguousarray(scale[parts.order], dtype=float),
        times=np.ascontiguousarray(times, dtype=float),
        drive=drive,
    )


def rates_of(parts: Compiled, times: Array) -> Rates:
    """First and second derivatives of the drives (fourth-order central differences)."""
    drive = np.zeros((len(times), 2, len(parts.drives)))
    for index, function in enumerate(parts.drives):
        if function is None:
            continue

        def value(s: float, f: Callable[[float], float] = function) -> Array:
            return np.array([f(s)])

        def slope(s: float, f: Callable[[float], Array] = value) -> Array:
            return _slope(f, s)

        for node, t in enumerate(times):
            drive[node, 0, index] = slope(float(t))[0]
            drive[node, 1, index] = _slope(slope, float(t))[0]
    return Rates(motion=np.zeros((len(times), 0)), drive=drive)

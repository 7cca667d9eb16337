"""From a `System` to the flat tables of the kernels, once per system, and its samples on a time grid.

Members are sorted into segments (one pair of bodies, one law); `order` maps segment position to member
number.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary, ref

import numpy as np

from ..compiler.owned_tables import OwnedTables
from ..elements.element import Element
from ..elements.laws import UserLaw
from ..elements.prescribed_motion import Motion, _slope
from ..elements.table import PARAMETERS, code_of
from ..errors import InvalidSystem
from ._kernels.equations import FUSED
from ._kernels.row_kinds import ANGLE, COINCIDENT_Y, DISTANCE, LINE
from ._kernels.saddle import Saddle, saddle_of
from ._kernels.tables import SpringTables, Tables
from .joints import Row
from .members import Member
from .system import System

__all__ = [
    "Compiled",
    "UserSegment",
    "acting_tables",
    "compiled",
    "in_member_order",
    "on_grid",
    "scale_slope",
]

Array = np.ndarray[Any, Any]

FEW = 0.75  # of the members: where more act, leaving out the others gains nothing
COINCIDENT = 1e-9  # m; members shorter than this are treated as this long, so coincident ends give b = 0
_GROUND = Motion(
    position=lambda t: (0.0, 0.0, 0.0),
    velocity=lambda t: (0.0, 0.0, 0.0),
    acceleration=lambda t: (0.0, 0.0, 0.0),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class UserSegment:
    """Members of one user's law between one pair of bodies: positions first..last-1 in segment order."""

    law: UserLaw
    pair: int
    first: int
    last: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compiled(OwnedTables[System]):
    """The time-independent tables of a system."""

    arrays: dict[str, Array]
    order: Array  # (N,) member number at each segment position
    inverse: Array | None  # (N,) segment position of each member; None where they stand in order
    power: Array  # (N,) SIMP power in member order
    row_names: tuple[str, ...]
    drives: tuple[Callable[[float], float] | None, ...]
    motions: tuple[Motion, ...]  # prescribed bodies and the ground
    user: tuple[UserSegment, ...]
    start: tuple[Array, Array]  # q, v
    saddle: Saddle | None  # the band of the saddle matrix, where it is narrow
    samples: dict[str, "Samples"] = field(default_factory=dict, repr=False)  # on the last grid asked for

    @property
    def fused(self) -> bool:
        """Whether the compiled time loops can run it (no law of the user's own)."""
        return not self.user


_CACHE: WeakKeyDictionary[System, Compiled] = WeakKeyDictionary()


def compiled(system: System) -> Compiled:
    """The compiled tables of a system, built on first use and kept as long as the system lives."""
    found = _CACHE.get(system)
    if found is None:
        found = _CACHE[system] = _compile(system)
    return found


class _Pairs:
    """Directed pairs of bodies, numbered as they are asked for."""

    def __init__(self, system: System) -> None:
        names = [body.name for body in (*system.free, *system.prescribed)]
        self.index = {name: i for i, name in enumerate([*names, "ground"])}
        self.numbers: dict[tuple[int, int], int] = {}

    def __call__(self, a: str, b: str) -> int:
        key = (self.index[a], self.index[b])
        return self.numbers.setdefault(key, len(self.numbers))

    def array(self) -> Array:
        return np.array(list(self.numbers), np.int64).reshape(-1, 2)


def _compile(system: System) -> Compiled:
    pairs = _Pairs(system)
    bodies = (*system.free, *system.prescribed)
    places = [np.array(b.position if b.motion is None else b.motion.place(0.0), float) for b in bodies]
    places.append(np.zeros(3))
    order, segments, geometry, law, user = _segments(system.members, pairs, places)

    gravity = np.zeros((len(system.free), 3))
    mass = np.array([(b.mass, b.mass, b.inertia) for b in system.free], float)
    for i, body in enumerate(system.free):
        if body.gravity:
            gravity[i, :2] = body.mass * np.asarray(system.gravity)

    element, element_data = _elements(system.force_elements, pairs, places)
    rows, data, names, drives = _rows(system, pairs, places)
    load = [(pairs.index[load.body], int(load.follower), 0, 0) for load in system.loads]
    arrays = {
        "mass": mass.ravel(),
        "gravity": gravity.ravel(),
        "pair": pairs.array(),
        "segment": np.array(segments, np.int64).reshape(-1, 4),
        "geometry": geometry,
        "law": law,
        "element": element,
        "element_data": element_data,
        "state_pair": element[element[:, 2] >= 0, 0].copy(),
        "row": np.array(rows, np.int64).reshape(-1, 4),
        "row_data": np.array(data, float).reshape(-1, 7),
        "load": np.array(load, np.int64).reshape(-1, 4),
        "load_point": np.array([load.point for load in system.loads], float).reshape(-1, 2),
    }
    q0 = np.array([b.position for b in system.free], float).ravel()
    v0 = np.array([b.velocity for b in system.free], float).ravel()
    return Compiled(
        owner=ref(system),
        arrays=arrays,
        order=order,
        inverse=None if (np.diff(order) > 0).all() else np.argsort(order),
        power=np.array([m.power for m in system.members], float),
        row_names=tuple(names),
        drives=tuple(drives),
        motions=(*(b.motion for b in system.prescribed if b.motion is not None), _GROUND),
        user=user,
        start=(q0, v0),
        saddle=saddle_of(len(q0), arrays["pair"], arrays["row"]),
    )


def _segments(
    members: tuple[Member, ...], pairs: _Pairs, places: list[Array]
) -> tuple[Array, list[tuple[int, int, int, int]], Array, Array, tuple[UserSegment, ...]]:
    """Sort members by pair and law; a member's ends may be exchanged, its length does not care."""
    count = len(members)
    keys, ends = [], []
    for member in members:
        swap = pairs.index[member.a] > pairs.index[member.b]
        a, b = (member.b, member.a) if swap else (member.a, member.b)
        ends.append((member.point_b, member.point_a) if swap else (member.point_a, member.point_b))
        code = member.law.code
        if code == code_of("Spring") and member.law.parameters[1] == 0.0:
            code = FUSED
        keys.append((pairs(a, b), code, id(member.law) if code == UserLaw.code else 0))
    order = np.array(sorted(range(count), key=lambda i: (keys[i], i)), np.int64)

    geometry: list[tuple[float, ...]] = []
    law: list[tuple[float, ...]] = []
    pair_list = list(pairs.numbers)
    turned = [(float(x), float(y), float(np.cos(th)), float(np.sin(th))) for x, y, th in places]
    for i in order.tolist():
        member, (s1, s2) = members[i], ends[i]
        offset2 = max(member.offset**2, COINCIDENT**2)
        length = member.natural_length
        if length is None:
            one, two = pair_list[keys[i][0]]
            (x1, y1), (x2, y2) = _point_at(turned[one], s1), _point_at(turned[two], s2)
            length = math.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2 + offset2)
        geometry.append((*s1, *s2, offset2, length))
        given = () if isinstance(member.law, UserLaw) else tuple(member.law.parameters)
        law.append(given + (0.0,) * (PARAMETERS - len(given)))

    segments: list[tuple[int, int, int, int]] = []
    user: list[UserSegment] = []
    first = 0
    for at in range(1, count + 1):
        if at == count or keys[order[at]] != keys[order[first]]:
            pair, code, _ = keys[order[first]]
            segments.append((pair, code, first, at))
            owner = members[order[first]].law
            if isinstance(owner, UserLaw):
                user.append(UserSegment(law=owner, pair=pair, first=first, last=at))
            first = at
    return order, segments, _columns(geometry, 6), _columns(law, PARAMETERS), tuple(user)


def _columns(rows: list[tuple[float, ...]], size: int) -> Array:
    """(size, rows)"""
    return np.array(rows, float).reshape(-1, size).T.copy()


def _elements(elements: tuple[Element, ...], pairs: _Pairs, places: list[Array]) -> tuple[Array, Array]:
    """(E, 3) pair, code and number of the state or -1 of the force elements, and (., E) their parameters."""
    numbers, columns, states = [], [], 0
    for element in elements:
        pair = pairs(element.a, element.b)
        numbers.append((pair, element.code, states if element.states else -1))
        states += element.states
        columns.append(element.column(_seen(places[pairs.index[element.a]], places[pairs.index[element.b]])))
    data = np.zeros((max(map(len, columns), default=0), len(columns)))
    for number, column in enumerate(columns):
        data[: len(column), number] = column
    return np.array(numbers, np.int64).reshape(-1, 3), data


def _seen(a: Array, b: Array) -> Array:
    """(3,) position and angle of a body seen from another."""
    c, s = np.cos(b[2]), np.sin(b[2])
    x, y, angle = a - b
    return np.array([c * x + s * y, c * y - s * x, angle])


def _rows(
    system: System, pairs: _Pairs, places: list[Array]
) -> tuple[list[tuple[int, int, int, int]], list[tuple[float, ...]], list[str], list[Any]]:
    rows: list[tuple[int, int, int, int]] = []
    data: list[tuple[float, ...]] = []
    names: list[str] = []
    drives: list[Any] = []
    for number, joint in enumerate(system.joints):
        label = joint.name or f"{type(joint).__name__} {number} ({joint.a}-{joint.b})"
        i, j = pairs.index[joint.a], pairs.index[joint.b]
        for part, row in enumerate(joint.rows()):
            target = _start_value(row, places[i], places[j]) if row.target is None else row.target
            if row.kind == DISTANCE and not target > 0.0:
                raise InvalidSystem(f"joint '{label}' needs a length > 0 m, got {target}")
            pair = pairs(joint.a, joint.b) if row.kind >= LINE else 0
            rows.append((row.kind, pair, i, j))
            data.append((*row.point_a, *row.point_b, *row.normal, target))
            names.append(f"{label}, row {part}")
            drives.append(row.drive)
    return rows, data, names, drives


def _point(place: Array, s: tuple[float, float]) -> Array:
    x, y, angle = place.tolist()
    return np.array(_point_at((x, y, float(np.cos(angle)), float(np.sin(angle))), s))


def _point_at(turned: tuple[float, float, float, float], s: tuple[float, float]) -> tuple[float, float]:
    """A point of a body whose place is given as x, y, cos and sin of its angle."""
    x, y, c, si = turned
    return x + c * s[0] - si * s[1], y + si * s[0] + c * s[1]


def _start_value(row: Row, a: Array, b: Array) -> float:
    if row.kind == ANGLE:
        return float(a[2] - b[2])
    d = _point(a, row.point_a) - _point(b, row.point_b)
    if row.kind == DISTANCE:
        return float(np.hypot(*d))
    c, s = np.cos(b[2]), np.sin(b[2])
    return float(row.normal[0] * (c * d[0] + s * d[1]) + row.normal[1] * (c * d[1] - s * d[0]))


def plain(parts: Compiled) -> bool:
    """Whether the system holds nothing but undamped springs, coincident points and loads."""
    arrays = parts.arrays
    return bool(
        (arrays["segment"][:, 1] == FUSED).all()
        and len(arrays["element"]) == 0
        and (arrays["row"][:, 0] <= COINCIDENT_Y).all()
    )


def on_grid(parts: Compiled, density: Array, times: Array) -> Tables:
    """Tables of one design (member order), with loads, motions and drives sampled at `times`.

    The samples of the last grid are kept: designs of one system differ in the scale of the members alone.
    """
    kept = parts.samples.get("last")
    if kept is None or not np.array_equal(kept.times, times):
        kept = parts.samples["last"] = _sampled(parts, times)
    scale = density if (parts.power == 1.0).all() else density**parts.power
    kind: Any = SpringTables if plain(parts) else Tables
    return kind(  # type: ignore[no-any-return]
        **parts.arrays,
        scale=np.ascontiguousarray(scale[parts.order]),
        **kept._asdict(),
    )


class Samples(NamedTuple):
    """Functions of time of a system on a grid, as in `Tables`."""

    times: Array
    load_sample: Array
    motion: Array
    drive: Array


def _sampled(parts: Compiled, times: Array) -> Samples:
    system = parts.system
    count = len(times)
    moves = [callable(load.force) or callable(load.torque) for load in system.loads]
    still = [
        np.zeros(3) if moving else load.sample(0.0) for load, moving in zip(system.loads, moves, strict=True)
    ]
    loads = np.empty((count, len(system.loads), 3))
    loads[:] = np.array(still).reshape(-1, 3)  # one after the other would take longer than the rest
    for index in np.flatnonzero(moves).tolist():
        loads[:, index] = [system.loads[index].sample(float(t)) for t in times]
    motion = np.zeros((count, 2, 3 * len(parts.motions)))
    for index, body in enumerate(parts.motions[:-1]):
        motion[:, :, 3 * index : 3 * index + 3] = body.sampled(times)
    drive = np.zeros((count, len(parts.drives)))
    for index, function in enumerate(parts.drives):
        if function is not None:
            drive[:, index] = [function(float(t)) for t in times]
    return Samples(np.array(times, dtype=float), loads, motion, drive)


def acting_tables(tables: Tables) -> Tables:
    """The tables without members of scale zero, which do nothing in a run; themselves where most act.

    An optimised layout has a few dozen members out of hundreds. The order of the others stays, and every
    segment, though it may be empty. Slopes by density are contracted over the tables of all members.
    """
    acts = tables.scale != 0.0
    if acts.sum() > FEW * len(acts):
        return tables
    place = np.concatenate([[0], np.cumsum(acts)])
    segment = tables.segment.copy()
    segment[:, 2:] = place[segment[:, 2:]]
    return tables._replace(
        segment=segment, geometry=np.ascontiguousarray(tables.geometry[:, acts]),
        law=np.ascontiguousarray(tables.law[:, acts]), scale=tables.scale[acts],
    )  # fmt: skip


def drive_slopes(parts: Compiled, t: float) -> tuple[Array, Array]:
    """First and second time derivatives of the drives (fourth-order central differences)."""
    first = np.zeros(len(parts.drives))
    second = np.zeros(len(parts.drives))
    for index, function in enumerate(parts.drives):
        if function is not None:

            def value(s: float, f: Callable[[float], float] = function) -> Array:
                return np.array([f(s)])

            def slope(s: float, f: Callable[[float], Array] = value) -> Array:
                return _slope(f, s)

            first[index] = slope(t)[0]
            second[index] = _slope(slope, t)[0]
    return first, second


def scale_slope(parts: Compiled, density: Array) -> Array:
    """(N,) d scale/d alpha = power alpha^(power - 1) in segment order."""
    if (parts.power == 1.0).all():
        return np.ones(len(parts.order))
    alpha, power = density[parts.order], parts.power[parts.order]
    return np.where(power == 1.0, 1.0, power * alpha ** (power - 1.0))


def in_member_order(by_segment: Array, inverse: Array | None) -> Array:
    """Turn segment order into member order; None where they are the same."""
    return by_segment if inverse is None else by_segment[inverse]

"""From a `TreeSystem` to the flat tables of the kernels: links depth first, columns, elements, pattern.

A joint of several kinds of freedom becomes several links, the first ones without mass: floating = translation
and spherical, universal = two revolutes, cylindrical and planar = translation and revolute. Welded bodies
join the link that carries them. Children are sorted by name, so nothing depends on the order of declaration.
"""

from dataclasses import dataclass, field
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary, ref

import numpy as np

from ..compiler.held import marked
from ..compiler.owned_tables import OwnedTables
from ..elements.laws import UserLaw
from ..elements.samples_kept import sampled_once
from ..elements.table import PARAMETERS
from ..errors import InvalidSystem
from ._kernels.factors import Pattern, elimination
from ._kernels.members import NEAR
from ._kernels.tables import DRIVEN, REVOLUTE, SPHERICAL, TRANSLATION, TreeTables, laws_listed
from .elements import friction_samples
from .joints import (
    Cylindrical,
    Floating,
    Planar,
    Prescribed,
    Prismatic,
    Revolute,
    SpatialMotion,
    Spherical,
    Universal,
    Welded,
    sampled,
)
from .loops.closing import closed
from .loops.cuts import CutJoint, CutRows, cut_rows, resolved_cut
from .start import Place, start_frames
from .surface_tables import surface_tables
from .system import GROUND, SpatialBody, TreeSystem, link_inertia

__all__ = ["Place", "TreeCompiled", "tree_compiled", "tree_on_grid", "tree_opened"]

Array = np.ndarray[Any, Any]

# what kernels are compiled without where a system holds none of it
MAY_BE_ABSENT = (
    "pair", "other_law", "bushing_pair", "surface", "contact", "tyre", "strut", "spring_column",
    "damper_column", "ball_column", "coupling_column", "cut", "load", "drive",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TreeCompiled(OwnedTables[TreeSystem]):
    """The time-independent tables of a tree; n velocities, x states."""

    arrays: dict[str, Array]
    places: dict[str, Place]
    columns: dict[str, slice]  # of every body's joint in v
    coordinates: dict[str, slice]  # in q
    drives: tuple[SpatialMotion, ...]
    states: tuple[str, ...]
    order: Array  # (N,) member number at each segment position
    power: Array  # (N,) in member order
    start: tuple[Array, Array]
    pattern: Pattern
    cuts: tuple[CutJoint, ...]
    cut_rows: CutRows  # all conditions of the cut joints
    kept: Array  # which of them are independent and stand in the tables
    samples: dict[bytes, dict[str, Array]] = field(default_factory=dict, repr=False)  # on the last grids

    @property
    def size(self) -> int:
        """Velocities, states and conditions together."""
        return len(self.arrays["column"]) + len(self.states) + len(self.arrays["cut"])


_CACHE: WeakKeyDictionary[TreeSystem, TreeCompiled] = WeakKeyDictionary()


def tree_compiled(system: TreeSystem) -> TreeCompiled:
    """The compiled tables, built on first use."""
    found = _CACHE.get(system)
    if found is None:
        found = tree_opened(system)
        found = _CACHE[system] = closed(found, tree_on_grid) if system.cuts else found
    return found


@dataclass(slots=True)
class _Links:
    """Links as they are collected, parents before children; -1 stands for the ground."""

    rows: list[list[int]] = field(default_factory=list)
    place: list[Array] = field(default_factory=list)
    axes: list[Array] = field(default_factory=list)
    inertia: list[Array] = field(default_factory=list)
    column: list[tuple[int, int]] = field(default_factory=list)
    q: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)
    drives: list[SpatialMotion] = field(default_factory=list)
    places: dict[str, Place] = field(default_factory=dict)
    columns: dict[str, slice] = field(default_factory=dict)
    coordinates: dict[str, slice] = field(default_factory=dict)

    def add(
        self, kind: int, parent: int, frame: tuple[Array, Array], axes: Any, q: Any = (), v: Any = ()
    ) -> int:
        """A new link; its number."""
        axes = np.asarray(axes, float).reshape(-1, 3)
        axes = axes / np.linalg.norm(axes, axis=1)[:, None] if len(axes) else axes
        number, drive = len(self.rows), len(self.drives) - 1 if kind == DRIVEN else -1
        self.rows.append([kind, parent, len(self.v), len(v), len(self.q), drive])
        self.place.append(np.concatenate([frame[1], frame[0].ravel()]))
        self.axes.append(np.concatenate([axes.ravel(), np.zeros(9 - axes.size)]))
        self.inertia.append(np.zeros(10))
        self.column += [(number, i) for i in range(len(v))]
        self.q += [float(x) for x in q]
        self.v += [float(x) for x in v]
        return number

    def body(self, body: SpatialBody) -> None:
        """Add a body behind its parent's."""
        base = self.places[body.parent]
        frame = base.turn @ np.asarray(body.axes, float), base.at + base.turn @ np.asarray(body.at, float)
        columns, coordinates = len(self.v), len(self.q)
        link = self._joint(body, base.link, frame)
        if isinstance(body.joint, Welded):
            self.places[body.name] = Place(link=link, turn=frame[0], at=frame[1])
        else:
            self.places[body.name] = Place(link=link, turn=np.eye(3), at=np.zeros(3))
        self.columns[body.name] = slice(columns, len(self.v))
        self.coordinates[body.name] = slice(coordinates, len(self.q))
        if link >= 0:
            self.inertia[link] = self.inertia[link] + link_inertia(body, self.places[body.name])

    def _joint(self, body: SpatialBody, parent: int, frame: tuple[Array, Array]) -> int:
        straight, eye = (np.eye(3), np.zeros(3)), np.eye(3)
        match body.joint:
            case Welded():
                return parent
            case Prescribed(motion=motion):
                self.drives.append(motion)
                return self.add(DRIVEN, parent, frame, ())
            case Revolute() as j:
                return self.add(REVOLUTE, parent, frame, j.axis, [j.angle], [j.speed])
            case Prismatic() as j:
                return self.add(TRANSLATION, parent, frame, j.axis, [j.position], [j.speed])
            case Spherical() as j:
                return self.add(SPHERICAL, parent, frame, eye, _unit(body.name, j.orientation), j.spin)
            case Floating() as j:
                carrier = self.add(TRANSLATION, parent, frame, eye, j.position, j.velocity)
                turn = _unit(body.name, j.orientation)
                return self.add(SPHERICAL, carrier, straight, eye, turn, j.spin)
            case Universal() as j:
                carrier = self.add(REVOLUTE, parent, frame, j.axes[0], [j.angles[0]], [j.speeds[0]])
                return self.add(REVOLUTE, carrier, straight, j.axes[1], [j.angles[1]], [j.speeds[1]])
            case Cylindrical() as j:
                carrier = self.add(TRANSLATION, parent, frame, j.axis, [j.position], [j.speed])
                return self.add(REVOLUTE, carrier, straight, j.axis, [j.angle], [j.angular_speed])
            case Planar() as j:
                carrier = self.add(TRANSLATION, parent, frame, j.axes, j.position, j.velocity)
                normal = np.cross(*np.asarray(j.axes, float))
                return self.add(REVOLUTE, carrier, straight, normal, [j.angle], [j.angular_speed])


def _unit(name: str, orientation: Any) -> Array:
    q = np.asarray(orientation, float)
    if q.shape != (4,) or np.linalg.norm(q) == 0.0:
        raise InvalidSystem(f"joint of '{name}' needs an orientation (w, x, y, z), got {orientation}")
    return q / np.linalg.norm(q)


def _gather(system: TreeSystem) -> _Links:
    children: dict[str, list[SpatialBody]] = {}
    for body in sorted(system.bodies, key=lambda body: body.name):
        children.setdefault(body.parent, []).append(body)
    links = _Links(places={GROUND: Place(link=-1, turn=np.eye(3), at=np.zeros(3))})
    waiting = children.get(GROUND, [])[::-1]
    while waiting:
        body = waiting.pop()
        links.body(body)
        waiting += children.get(body.name, [])[::-1]
    if not links.v:
        raise InvalidSystem("system needs at least one joint that moves freely, got none")
    return links


@dataclass(slots=True)
class _Pairs:
    """Pairs of links with elements between them, and the columns that move one of them alone."""

    links: _Links
    number: dict[tuple[int, int], int] = field(default_factory=dict)

    def of(self, a: int, b: int, where: str) -> int:
        """The number of a pair."""
        if a == b:
            raise InvalidSystem(f"{where} lies within one rigid part (welded bodies): it would do nothing")
        return self.number.setdefault((a, b), len(self.number))

    def _up(self, link: int) -> list[int]:
        out: list[int] = []
        while link >= 0:
            _, parent, first, count, _, _ = self.links.rows[link]
            out += range(first, first + count)
            link = parent
        return out

    def tables(self, ground: int) -> tuple[Array, Array]:
        """(P, 4) and (columns, 2) of `TreeTables`."""
        pair: list[list[int]] = []
        path: list[tuple[int, int]] = []
        for a, b in self.number:
            up_a, up_b = set(self._up(a)), set(self._up(b))
            rows = [(c, 1) for c in sorted(up_a - up_b)] + [(c, -1) for c in sorted(up_b - up_a)]
            pair.append([a % (ground + 1), b % (ground + 1), len(path), len(path) + len(rows)])
            path += rows
        return np.array(pair, np.int64).reshape(-1, 4), np.array(path, np.int64).reshape(-1, 2)


def _point(place: Place, point: Any) -> Array:
    return place.at + place.turn @ np.asarray(point, float)


def _members(system: TreeSystem, links: _Links, pairs: _Pairs) -> tuple[dict[str, Array], Array]:
    """Segments, geometry and laws; and the order of members."""
    keyed = []
    for i, member in enumerate(system.members):
        a, b = links.places[member.a], links.places[member.b]
        s, r = _point(a, member.point_a), _point(b, member.point_b)
        if a.link < b.link:  # the ground, -1, stands second
            a, b, s, r = b, a, r, s
        keyed.append((pairs.of(a.link, b.link, f"members[{i}]"), member.law.code, i, s, r))
    keyed.sort(key=lambda row: row[:3])
    order = np.array([row[2] for row in keyed], np.int64)
    segment: list[list[int]] = []
    for at, (pair, code, *_) in enumerate(keyed):
        if not segment or segment[-1][:2] != [pair, code]:
            segment.append([pair, code, at, at])
        segment[-1][3] = at + 1
    count = len(keyed)
    geometry, law = np.zeros((7, count)), np.zeros((PARAMETERS, count))
    for at, (_, _, i, s, r) in enumerate(keyed):
        geometry[:3, at], geometry[3:6, at] = s, r
        given = system.members[i].law
        assert not isinstance(given, UserLaw)  # refused by the system
        law[: len(given.parameters), at] = given.parameters
    table = np.array(segment, np.int64).reshape(-1, 4)
    other = laws_listed(table[:, 1], every="other_law" not in MAY_BE_ABSENT)
    return {"segment": table, "other_law": other, "geometry": geometry, "law": law}, order


def _bushings(system: TreeSystem, links: _Links, pairs: _Pairs) -> tuple[dict[str, Array], tuple[str, ...]]:
    rows: list[list[int]] = []
    states: list[str] = []
    data = np.zeros((26, len(system.bushings)))
    for u, bushing in enumerate(system.bushings):
        a, b = links.places[bushing.a], links.places[bushing.b]
        column = np.array(bushing.column())
        column[15:18], column[18:21] = _point(a, column[15:18]), b.turn.T @ _point(b, column[18:21])
        if not np.allclose(b.turn, np.eye(3)):
            raise InvalidSystem(
                f"bushings[{u}] lies in the axes of the welded body '{bushing.b}', which are turned against "
                "the part that carries it; name that part instead"
            )
        data[:, u] = column
        state = -1
        if bushing.breakable:
            state = len(states)
            states.append(f"damage of bushing '{bushing.name or f'{bushing.a}-{bushing.b}'}'")
        rows.append([pairs.of(a.link, b.link, f"bushings[{u}]"), state, 0])
    return {"bushing_pair": np.array(rows, np.int64).reshape(-1, 3), "bushing": data}, tuple(states)


def _coordinate_elements(system: TreeSystem, links: _Links) -> dict[str, Array]:
    def of(body: str, coordinate: int) -> tuple[int, int]:
        return links.columns[body].start + coordinate, links.coordinates[body].start + coordinate

    springs, data = [], np.zeros((8, len(system.springs)))
    for t, s in enumerate(system.springs):
        springs.append(of(s.body, s.coordinate))
        rest = links.q[springs[-1][1]] if s.rest is None else s.rest
        data[:, t] = s.k, s.c, rest, s.k_stop, s.upper, s.lower, s.width, s.torque
    dampers = [of(d.body, d.coordinate)[0] for d in system.dampers]
    balls = [
        (links.columns[s.body].stop - 3, links.coordinates[s.body].stop - 4) for s in system.spherical_springs
    ]
    couplings, pulls = [], []
    for c in system.couplings:
        (i, p), (j, q) = of(c.a, c.coordinate_a), of(c.b, c.coordinate_b)
        couplings.append((i, j, p, q))
        pulls.append((c.k, c.c, links.q[p] - links.q[q] if c.rest is None else c.rest))
    return {
        "spring_column": np.array(springs, np.int64).reshape(-1, 2), "spring": data,
        "damper_column": np.array(dampers, np.int64),
        "damper": np.array([d.numbers() for d in system.dampers]).reshape(-1, 3),
        "ball_column": np.array(balls, np.int64).reshape(-1, 2),
        "ball": np.array([(s.k, s.c) for s in system.spherical_springs]).reshape(-1, 2),
        "ball_rest": np.array([
            links.q[at : at + 4] if s.rest is None else _unit(s.body, s.rest)
            for s, (_, at) in zip(system.spherical_springs, balls, strict=True)
        ]).reshape(-1, 4),
        "coupling_column": np.array(couplings, np.int64).reshape(-1, 4),
        "coupling": np.array(pulls).reshape(-1, 3),
    }  # fmt: skip


def _loads(system: TreeSystem, links: _Links, pairs: _Pairs) -> dict[str, Array]:
    rows = []
    points = np.zeros((len(system.loads), 3))
    for i, load in enumerate(system.loads):
        place = links.places[load.body]
        points[i] = _point(place, load.point)
        rows.append([pairs.of(place.link, -1, f"loads[{i}]"), int(load.follows), int(load.force is None)])
    return {"load": np.array(rows, np.int64).reshape(-1, 3), "load_point": points}


def tree_opened(system: TreeSystem) -> TreeCompiled:
    """The tables as given: with all conditions of the cut joints, whether the start meets them or not."""
    links = _gather(system)
    pairs = _Pairs(links=links)
    members, order = _members(system, links, pairs)
    bushings, states = _bushings(system, links, pairs)
    surfaces, more, begun = surface_tables(system, links.places, pairs.of, len(states))
    begun, states = (*np.zeros(len(states)), *begun), states + more
    loads = _loads(system, links, pairs)
    frames = start_frames(system.bodies) if system.cuts else {}
    cuts = tuple(resolved_cut(cut, frames) for cut in system.cuts)
    rows = cut_rows(cuts, links.places, pairs.of)
    ground = len(links.rows)
    pair, path = pairs.tables(ground)
    link = np.array(links.rows, np.int64)
    link[link[:, 1] < 0, 1] = ground
    floating = [i for i, row in enumerate(link) if row[0] == SPHERICAL and link[i - 1, 0] == TRANSLATION]
    arrays = {
        "link": link, "place": np.array(links.place), "axes": np.array(links.axes),
        "inertia": np.array(links.inertia), "centre_link": np.array([*floating, -1][:1], np.int64),
        "gravity": np.array(system.gravity, float), "column": np.array(links.column, np.int64),
        "pair": pair, "path": path, **members, **bushings, **surfaces, **loads,
        "cut": rows.table, "cut_place": rows.place,
        **_coordinate_elements(system, links),
        "drive": np.flatnonzero(link[:, 0] == DRIVEN),
    }  # fmt: skip
    arrays |= {name: marked(arrays[name]) for name in MAY_BE_ABSENT if name != "other_law"}
    parts = TreeCompiled(
        owner=ref(system), arrays=arrays,
        places={
            name: Place(link=ground if p.link < 0 else p.link, turn=p.turn, at=p.at)
            for name, p in links.places.items()
        },
        columns=links.columns, coordinates=links.coordinates, drives=tuple(links.drives), states=states,
        order=order, power=np.array([m.power for m in system.members], float),
        start=(np.array(links.q), np.array([*links.v, *begun, *np.zeros(len(rows.table))])),
        pattern=elimination(arrays, len(states)), cuts=cuts, cut_rows=rows,
        kept=np.ones(len(rows.table), bool),
    )  # fmt: skip
    _natural_lengths(parts)
    return parts


def _natural_lengths(parts: TreeCompiled) -> None:
    """Lengths at the start where none is given; as the kernels measure them."""
    ends = parts.system.member_ends()
    lengths = np.sqrt(((ends.point_a - ends.point_b) ** 2).sum(axis=1) + NEAR)
    for at, i in enumerate(parts.order):
        given = parts.system.members[i].natural_length
        parts.arrays["geometry"][6, at] = lengths[i] if given is None else given


def tree_on_grid(
    parts: TreeCompiled, density: Array, times: Array, *, closing: Array | None = None
) -> TreeTables:
    """The tables of a run: densities, and all functions of time sampled at `times`, once for a grid.

    closing: (samples,) what the rows of cut joints stand for, accelerations (0) if None; see `_kernels.cuts`.
    """
    if len(density) != len(parts.power):
        raise ValueError(f"system has {len(parts.power)} members but density has {len(density)} entries")
    alpha, power = np.asarray(density)[parts.order], parts.power[parts.order]
    nodes = np.asarray(times, float)
    return TreeTables(
        **parts.arrays,
        scale=np.where(power == 1.0, alpha, alpha**power),
        times=nodes,
        closing=np.zeros(len(times)) if closing is None else closing,
        **sampled_once(parts.samples, nodes, partial(_sampled, parts)),
    )


def _sampled(parts: TreeCompiled, times: Array) -> dict[str, Array]:
    system, clock = parts.system, times.tolist()
    pulls = np.array([[load.sample(t) for load in system.loads] for t in clock])
    return {
        "load_sample": pulls.reshape(len(times), len(system.loads), 3),
        "friction_sample": friction_samples(system.dampers, clock),
        "motion": sampled(parts.drives, times),
    }

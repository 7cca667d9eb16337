"""Equivalent static loads of a run: under which a structure at rest would stand as the run moves.

Everything is seen from the objective's reference body, which is held. With K the members' stiffness there,
Phi_q of the joints, u the displacement at a node and alpha_k the density that ran,

    S(alpha) = [[K(alpha), Phi_q^T], [Phi_q, 0]]       S(alpha) y = S(alpha_k) (u, 0)       load K(alpha_k) u

classical   K and Phi_q of the start, u since the start (Kang, Choi and Park 2001)
difference  K and Phi_q as deformed at the node before, u since then, y summed up (Triller, Immel,
            Timmer and Harzheim 2021)

At alpha_k the static structure stands exactly as the run did; for other densities inertia and the change of
the loads are left out, and that is the method's error.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...elements.law_series import law_series
from ...objectives.quantities import Deviation
from ...planar.system import System
from ...planar.trajectory import Trajectory
from .problem import Evaluation, InvalidLayout, TabulatedRows
from .scenario import ScenarioRun

__all__ = ["StaticLoads", "static_evaluation", "static_loads"]

Array = NDArray[np.float64]

_NODES = 120  # of a run that get a static load case
_NEAR = 1e-18  # m^2, so that coincident ends have a direction


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticLoads:
    """The static load cases of one run: M pieces of displacement, n coordinates that move, m joint rows.

    stiffness (M or 1, N, n, n): of every member at density 1    jacobian (M or 1, m, n)
    displacement (M, n)    load (M, n + m)    place (M, 2): sqrt(W) R of the run    slopes (2, n): dR/dq
    summed: whether a node stands on all pieces up to it    scale: of the scenario
    """

    stiffness: Array
    jacobian: Array
    displacement: Array
    load: Array
    place: Array
    slopes: Array
    summed: bool
    scale: float

    def saddle(self, density: Array) -> Array:
        """(M or 1, n + m, n + m)."""
        return _saddle(np.einsum("i,kiab->kab", density, self.stiffness, optimize=True), self.jacobian)


def _saddle(stiffness: Array, jacobian: Array) -> Array:
    count, n = stiffness.shape[:2]
    m = jacobian.shape[1]
    out = np.zeros((count, n + m, n + m))
    out[:, :n, :n] = stiffness
    out[:, n:, :n] = jacobian
    out[:, :n, n:] = jacobian.transpose(0, 2, 1)
    return out


def static_loads(run: ScenarioRun, *, difference: bool) -> StaticLoads:
    """The load cases of a run. Raises InvalidLayout for what has no static counterpart here."""
    r, quantity = run.trajectory, run.scenario.objective.quantity
    if not isinstance(r, Trajectory) or not isinstance(quantity, Deviation) or r.system.in_python:
        raise InvalidLayout(
            "equivalent static loads are written for planar systems with the engine's own laws and the "
            "maximum of a Deviation; take method 'gsao'"
        )
    system, reference = r.system, quantity.reference
    moving = [body.name for body in system.free if body.name != reference]
    _check(system, moving, reference)
    stride = max(1, -(-(run.last - run.first) // _NODES))
    nodes = np.r_[run.last : 0 : -stride, 0][::-1]  # the start, then up to the end of the window
    seen = _seen(r, moving, reference, nodes)
    pieces = np.diff(seen, axis=0) if difference else seen[1:] - seen[0]
    at = seen[:-1] if difference else seen[:1]
    stiffness = _stiffness(r, moving, reference, at, r.times[nodes[: len(at)]])
    jacobian = _jacobian(r, moving, reference, at)
    now = _saddle(np.einsum("i,kiab->kab", r.density, stiffness, optimize=True), jacobian)
    given = np.pad(pieces, ((0, 0), (0, jacobian.shape[1])))
    load = np.einsum("kab,kb->ka", np.broadcast_to(now, (len(given), *now.shape[1:])), given)
    slopes = _slopes(r, quantity, moving)
    return StaticLoads(
        stiffness=stiffness, jacobian=jacobian, displacement=pieces, load=load,
        place=run.view()[0][nodes[1:]], slopes=slopes, summed=difference, scale=run.scenario.scale,
    )  # fmt: skip


def _check(system: System, moving: list[str], reference: str) -> None:
    known = {*moving, reference}
    for part in (*system.members, *system.joints):
        if not {part.a, part.b} <= known:
            raise InvalidLayout(
                f"equivalent static loads hold the reference '{reference}' alone; {type(part).__name__} "
                f"{part.a}-{part.b} ends at another body that does not move freely"
            )
    if any(member.power != 1.0 for member in system.members):
        raise InvalidLayout("equivalent static loads are written for members of power 1")


def _place(r: Trajectory, body: str, nodes: Array) -> Array:
    return np.zeros((len(nodes), 3)) if body == "ground" else np.asarray(r.of(body))[nodes]


def _seen(r: Trajectory, moving: list[str], reference: str, nodes: Array) -> Array:
    """(nodes, n) places of the moving bodies where the reference stays where it was at the start."""
    ref = _place(r, reference, nodes)
    turn = ref[0, 2] - ref[:, 2]
    c, s = np.cos(turn), np.sin(turn)
    found = []
    for body in moving:
        place = _place(r, body, nodes)
        d = place[:, :2] - ref[:, :2]
        found += [
            ref[0, 0] + c * d[:, 0] - s * d[:, 1], ref[0, 1] + s * d[:, 0] + c * d[:, 1], place[:, 2] + turn,
        ]  # fmt: skip
    return np.array(found).T


def _slopes(r: Trajectory, quantity: Deviation, moving: list[str]) -> Array:
    """(2, n) slopes of sqrt(W) R; the same at every node, since the reference is held."""
    shares = np.ones(len(quantity.bodies)) if quantity.shares is None else np.array(quantity.shares)
    angle = float(_place(r, quantity.reference, np.array([0]))[0, 2])
    c, s = np.cos(angle), np.sin(angle)
    out = np.zeros((2, 3 * len(moving)))
    for body, share in zip(quantity.bodies, shares / shares.sum(), strict=True):
        k = 3 * moving.index(body)
        out[:, k : k + 2] += share * np.array([[c, s], [-s, c]])
    return out * np.sqrt(np.array(quantity.weights))[:, None]


def _stiffness(r: Trajectory, moving: list[str], reference: str, places: Array, times: Array) -> Array:
    """(K, N, n, n) of every member at density 1, by its law and by the turning of its line."""
    system, K, n = r.system, len(places), places.shape[1]
    held = np.broadcast_to(_place(r, reference, np.array([0])), (K, 3))
    start = _seen(r, moving, reference, np.array([0]))
    count = len(system.members)
    elongation = np.empty((K, count))
    line: list[tuple[Array, Array, Array]] = []
    for i, member in enumerate(system.members):
        d, grow, bend = np.zeros((K, 2)), np.zeros((K, 2, n)), np.zeros((K, 2, n))
        d0 = np.zeros(2)
        for body, point, sign in ((member.a, member.point_a, 1.0), (member.b, member.point_b, -1.0)):
            at = 3 * moving.index(body) if body in moving else -1
            place = held if at < 0 else places[:, at : at + 3]
            first = held[0] if at < 0 else start[0, at : at + 3]
            arm, arm0 = _turned(place[:, 2], point), _turned(first[2:3], point)[0]
            d += sign * (place[:, :2] + arm)
            d0 += sign * (first[:2] + arm0)
            if at >= 0:
                grow[:, 0, at] = grow[:, 1, at + 1] = sign
                grow[:, :, at + 2] = sign * np.column_stack([-arm[:, 1], arm[:, 0]])
                bend[:, :, at + 2] = -sign * arm
        length = np.sqrt((d * d).sum(axis=1) + member.offset**2 + _NEAR)
        natural = member.natural_length
        if natural is None:
            natural = float(np.sqrt(d0 @ d0 + member.offset**2 + _NEAR))
        elongation[:, i] = length - natural
        u = d / length[:, None]
        b = np.einsum("ka,kan->kn", u, grow)
        turning = np.einsum("kan,kam->knm", grow, grow) - np.einsum("kn,km->knm", b, b)
        turning /= length[:, None, None]
        turning[:, np.arange(n), np.arange(n)] += np.einsum("ka,kan->kn", u, bend)
        line.append((b, turning, length))
    out = np.empty((K, count, n, n))
    alike: dict[int, list[int]] = {}
    for i, member in enumerate(system.members):
        alike.setdefault(member.law.code, []).append(i)
    for same in alike.values():
        laws = [system.members[i].law for i in same]
        series = law_series(laws, elongation[:, same], np.zeros((K, len(same))), np.asarray(times))
        for at, i in enumerate(same):
            b, turning, _ = line[i]
            out[:, i] = series.by_elongation[:, at, None, None] * b[:, :, None] * b[:, None, :]
            out[:, i] += series.force[:, at, None, None] * turning
    return out


def _turned(angle: Array, point: tuple[float, float]) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * point[0] - s * point[1], s * point[0] + c * point[1]])


def _jacobian(r: Trajectory, moving: list[str], reference: str, places: Array) -> Array:
    """(K, m, n) of the joints."""
    system = r.system
    if not system.joints:
        return np.zeros((len(places), 0, places.shape[1]))
    equations, found = r.linearised(method="equivalent static loads"), []
    names = [body.name for body in system.free]
    columns = [3 * names.index(body) + k for body in moving for k in range(3)]
    for place in places:
        q = np.array(r.position[0])
        q[columns] = place
        rows = equations.tangents(0, q, np.zeros(len(q)), np.zeros(r.multiplier.shape[1])).jacobian
        found.append(rows[:, columns])
    return np.array(found)


def static_evaluation(cases: list[StaticLoads], density: Array) -> Evaluation:
    """|R|^2 of the static structures of all runs at a density, with gradients and Gauss-Newton factors."""
    values, gradients, factors = [], [], []
    for case in cases:
        n = case.displacement.shape[1]
        inverse = np.linalg.inv(case.saddle(density))
        y = np.einsum("kab,kb->ka", np.broadcast_to(inverse, (len(case.load), *inverse.shape[1:])), case.load)
        moved = y[:, :n] - case.displacement
        # dR_k/dalpha_i of a piece: - slopes S^-1 (k_i y_k)
        reach = np.einsum("an,knb->kab", case.slopes, inverse[:, :n, :n])
        by_density = -np.einsum(
            "kab,kibc,kc->kai", np.broadcast_to(reach, (len(y), *reach.shape[1:])),
            np.broadcast_to(case.stiffness, (len(y), *case.stiffness.shape[1:])), y[:, :n], optimize=True,
        )  # fmt: skip
        if case.summed:
            moved, by_density = moved.cumsum(axis=0), by_density.cumsum(axis=0)
        R = case.place + moved @ case.slopes.T
        values.append((R * R).sum(axis=1) / case.scale)
        gradients.append(2.0 * np.einsum("ka,kai->ki", R, by_density) / case.scale)
        factors.append(np.sqrt(2.0 / case.scale) * by_density)
    nodes = max(len(v) for v in values)
    return TabulatedRows(
        values=np.array([np.pad(v, (0, nodes - len(v)), mode="edge") for v in values]),
        gradient_table=np.vstack([_padded(g, nodes) for g in gradients]),
        factor_table=np.vstack([_padded(w, nodes) for w in factors]),
        constraint_gradients=np.zeros((0, len(density))),
    )


def _padded(table: Array, nodes: int) -> Array:
    return np.concatenate([table, np.repeat(table[-1:], nodes - len(table), axis=0)])

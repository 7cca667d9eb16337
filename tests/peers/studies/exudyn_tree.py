"""A tree of the gunner study in Exudyn: its kinematic tree, its explicit Runge-Kutta method, laws anew.

Every body becomes links of single turns and slides. Forces are written from the laws' descriptions in NumPy,
as generalised forces of the tree; Exudyn brings masses, gyroscopic terms and the march, with the slips of the
tyres as first-order states. Front wheels follow the driver by a servo stiffer than anything around it. Grips
and seats have no memory here, so a run is comparable until one of them slips; roads are flat, and the shell
touches nothing.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from workbench.engine import Floating, Prescribed, TreeSystem, Universal

__all__ = ["ExudynTree"]

Array = np.ndarray[Any, Any]
SIDEWAYS, UP = np.eye(3)[1], np.eye(3)[2]
SERVO = 2e6, 8e3  # N m/rad, N m s/rad: holds a steering angle within 1e-4 rad


def cross(a: Array, b: Array) -> Array:
    """Of two triples; numpy's own costs ten times as much for single ones."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def turned_to(axis: Sequence[float]) -> Array:
    """A rotation whose third column is the axis."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = np.cross(z, (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0))
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def smooth(s: float) -> float:
    """s^3 (10 - 15 s + 6 s^2) between 0 and 1."""
    s = min(max(s, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def rounded(x: float, width: float) -> float:
    """max(0, x), rounded over the width."""
    s = x / width + 0.5
    return 0.0 if s <= 0.0 else x if s >= 1.0 else width * s**3 * (1.0 - 0.5 * s)


class Links:
    """Bodies as links of one coordinate: massless ones for all coordinates of a joint but the last."""

    def __init__(self, body: TreeSystem) -> None:
        self.parent: list[int] = []
        self.slides: list[bool] = []
        self.number: list[int] = []  # of the axis of the link
        self.turn: list[Array] = []  # against the parent's axes
        self.offset: list[Array] = []  # in them
        self.mass: list[float] = []
        self.centre: list[Array] = []
        self.inertia: list[Array] = []
        self.start: list[tuple[float, float]] = []
        self.last: dict[str, tuple[int, Array]] = {}  # link of a body, and that link's turn against its axes
        self.coordinate: dict[tuple[str, int], int] = {}
        self.driven: list[tuple[int, Any]] = []
        for segment in body.bodies:
            self._add(segment)
        self.size = len(self.parent)

    def _add(self, body: Any) -> None:
        joint, inertia = body.joint, np.asarray(body.inertia, float)
        inertia = np.diag(inertia) if inertia.shape == (3,) else inertia
        parent, turn, at = -1, np.eye(3), np.asarray(body.at, float)
        if isinstance(joint, Floating):
            at = np.asarray(joint.position, float)
            steps = [(True, k, np.eye(3), (0.0, joint.velocity[k])) for k in range(3)]
            steps += [(False, k, np.eye(3), (0.0, 0.0)) for k in (2, 1, 0)]
        else:
            parent, turn = self.last[body.parent]
            if isinstance(joint, Universal):
                steps = [(False, 2, turned_to(axis), (0.0, 0.0)) for axis in joint.axes]
            elif isinstance(joint, Prescribed):
                steps = [(False, 2, np.eye(3), (0.0, 0.0))]
            else:
                steps = [(False, 2, turned_to(joint.axis), (joint.angle, joint.speed))]
        for i, (slides, number, own, start) in enumerate(steps):
            full = i == len(steps) - 1
            self.coordinate[body.name, i] = len(self.parent)
            self.parent.append(parent)
            self.slides.append(slides)
            self.number.append(number)
            self.turn.append(turn.T @ own)
            self.offset.append(turn.T @ at)
            self.mass.append(body.mass * full)
            self.centre.append(own.T @ np.asarray(body.centre, float) * full)
            self.inertia.append(own.T @ inertia @ own * full)
            self.start.append(start)
            parent, turn, at = len(self.parent) - 1, own, np.zeros(3)
        self.last[body.name] = parent, turn
        if isinstance(joint, Prescribed):
            self.driven.append((parent, joint.motion))

    def frames(self, q: Array, v: Array) -> tuple[Array, ...]:
        """Axes (n, 3, 3), origins, spins, velocities of the origins and axes of the coordinates (n, 3)."""
        n = self.size
        R, (r, w, u, axis) = np.empty((n, 3, 3)), np.empty((4, n, 3))
        for i, p in enumerate(self.parent):
            if p < 0:
                A, at, spin, speed = self.turn[i], self.offset[i], np.zeros(3), np.zeros(3)
            else:
                arm = R[p] @ self.offset[i]
                A, at, spin, speed = R[p] @ self.turn[i], r[p] + arm, w[p], u[p] + cross(w[p], arm)
            k = self.number[i]
            a = axis[i] = A[:, k]
            R[i] = A
            if self.slides[i]:
                r[i], w[i], u[i] = at + a * q[i], spin, speed + cross(spin, a) * q[i] + a * v[i]
                continue
            c, s, b, d = np.cos(q[i]), np.sin(q[i]), (k + 1) % 3, (k + 2) % 3
            R[i][:, b], R[i][:, d] = c * A[:, b] + s * A[:, d], c * A[:, d] - s * A[:, b]
            r[i], w[i], u[i] = at, spin + a * v[i], speed
        return R, r, w, u, axis

    def generalised(self, frames: tuple[Array, ...], wrench: Array) -> Array:
        """(n,) forces on the coordinates of forces and moments about the origin (n, 6) on the links."""
        _, r, _, _, axis = frames
        total, out = wrench.copy(), np.empty(self.size)
        for i in range(self.size - 1, -1, -1):
            f, m = total[i, :3], total[i, 3:]
            out[i] = axis[i] @ f if self.slides[i] else axis[i] @ (m - cross(r[i], f))
            if self.parent[i] >= 0:
                total[self.parent[i]] += total[i]
        return out

    def point(self, frames: tuple[Array, ...], name: str, point: Sequence[float]) -> Array:
        """Where a point of a body is."""
        link, own = self.last[name]
        return np.asarray(frames[1][link] + frames[0][link] @ own.T @ np.asarray(point, float))

    def axes(self, frames: tuple[Array, ...], name: str) -> Array:
        """(3, 3) axes of a body."""
        link, own = self.last[name]
        return np.asarray(frames[0][link] @ own.T)


class ExudynTree:
    """A system of the study, to be run by Exudyn."""

    def __init__(self, body: TreeSystem) -> None:
        self.body, self.links = body, Links(body)
        ratio = [tyre.friction / tyre.reference_friction for tyre in body.tyres]
        self.peaks = [
            (mu * tyre.peak(lateral=False), mu * tyre.peak(lateral=True))
            for mu, tyre in zip(ratio, body.tyres, strict=True)
        ]

    def slip_rates(self, frames: tuple[Array, ...], slips: Array, wrench: Array | None = None) -> Array:
        """Rates of the slips, two per tyre; what the road does to the wheels is added to `wrench`."""
        _, r, w, u, _ = frames
        rates = np.empty(2 * len(self.body.tyres))
        for i, tyre in enumerate(self.body.tyres):
            link, _ = self.links.last[tyre.body]
            spin_axis = self.links.axes(frames, tyre.body) @ SIDEWAYS
            ahead = cross(spin_axis, UP)
            ahead /= np.linalg.norm(ahead)
            left, upwards = cross(UP, ahead), cross(ahead, spin_axis)
            depth = tyre.radius - r[link, 2] / upwards[2]
            arm = (rounded(depth, tyre.width) - tyre.radius) * upwards
            patch, speed = u[link] + cross(w[link], arm), u[link] @ ahead
            k, a = slips[2 * i : 2 * i + 2]
            fast = np.hypot(speed, tyre.slow)
            rates[2 * i] = -(patch @ ahead + fast * k) / tyre.relaxation
            rates[2 * i + 1] = -(patch @ left + fast * a) / tyre.relaxation
            if wrench is None:
                continue
            hold = rounded(1.0 - tyre.damping / tyre.nominal_load * u[link, 2], 0.5)
            load = tyre.stiffness * rounded(depth, tyre.width) * hold
            if load <= 0.0:
                continue
            along, aside = self.peaks[i]
            s = np.sqrt((k / along) ** 2 + (a / aside) ** 2 + 1e-18)
            force = load * UP + k / along / s * pacejka(tyre, load, s * along, lateral=False) * ahead
            force = force + a / aside / s * pacejka(tyre, load, s * aside, lateral=True) * left
            rolling = tyre.rolling_resistance * load * tyre.radius * np.tanh(speed / tyre.slow)
            wrench[link, :3] += force
            wrench[link, 3:] += cross(r[link] + arm, force) - rolling * spin_axis
        return rates

    def _joints(self, t: float, q: Array, v: Array) -> Array:
        links, out = self.links, np.zeros(self.links.size)
        for s in self.body.springs:
            i = links.coordinate[s.body, s.coordinate]
            angle = q[i] - (links.start[i][0] if s.rest is None else s.rest)
            high, low = (np.logaddexp(0.0, x / s.width) for x in (angle - s.upper, -angle - s.lower))
            out[i] += s.torque - s.k * angle - s.c * v[i] - s.k_stop * s.width * (high - low)
        for d in self.body.dampers:
            i = links.coordinate[d.body, d.coordinate]
            back, size = d.forward if d.backward is None else d.backward, np.hypot(v[i], d.slow)
            out[i] -= 0.5 * (d.forward + back) * v[i] + 0.5 * (d.forward - back) * (size - d.slow)
            out[i] -= d.friction_at(t) * v[i] / size
        for c in self.body.couplings:
            i, j = links.coordinate[c.a, c.coordinate_a], links.coordinate[c.b, c.coordinate_b]
            torque = -c.k * (q[i] - q[j] - links.start[i][0] + links.start[j][0]) - c.c * (v[i] - v[j])
            out[i] += torque
            out[j] -= torque
        for i, motion in links.driven:
            turned = np.asarray(motion.rotation(t))
            off = np.arctan2(turned[1, 0], turned[0, 0]) - q[i]
            out[i] += SERVO[0] * off + SERVO[1] * (motion.spin(t)[2] - v[i])
        return out

    def _bushings(self, frames: tuple[Array, ...], wrench: Array) -> None:
        _, r, w, u, _ = frames
        for b in self.body.bushings:
            i, j = self.links.last[b.a][0], self.links.last[b.b][0]
            at, home = self.links.point(frames, b.a, b.point_a), self.links.point(frames, b.b, b.point_b)
            axes = self.links.axes(frames, b.b)
            away = axes.T @ (at - home)
            rate = axes.T @ (u[i] + cross(w[i], at - r[i]) - u[j] - cross(w[j], at - r[j]))
            size, cap = np.sqrt(away @ away + b.eps**2), b.cap
            if b.opens is not None:
                opens = np.asarray(b.opens) / np.linalg.norm(b.opens)
                cap += (b.push_cap - b.cap) * smooth(-(away @ opens) / size)
            x, fades = b.k * size / cap, smooth((size - b.slip) / (b.release - b.slip))
            pull = cap * np.tanh(x) / size * away + b.c * rate / np.cosh(x) ** 2 - np.asarray(b.preload)
            force = -b.hold * (1.0 - fades) * (axes @ pull)
            wrench[i, :3] += force
            wrench[i, 3:] += cross(at, force)
            wrench[j, :3] -= force
            wrench[j, 3:] -= cross(at, force)

    def forces(self, t: float, q: Array, v: Array, slips: Array) -> Array:
        """(n,) generalised forces but gravity."""
        frames, wrench = self.links.frames(q, v), np.zeros((self.links.size, 6))
        self.slip_rates(frames, slips, wrench)
        self._bushings(frames, wrench)
        return self._joints(t, q, v) + self.links.generalised(frames, wrench)

    def run(self, exudyn: Any, item: Any, t_end: float, *, step: float, every: float) -> tuple[Array, Array]:
        """Times (m,) and coordinates of all links (m, n)."""
        links, kinds = self.links, exudyn.JointType
        slide, turn = "Prismatic", "Revolute"
        names = [(slide if s else turn) + "XYZ"[k] for s, k in zip(links.slides, links.number, strict=True)]
        system = exudyn.SystemContainer().AddSystem()
        nothing, slips = [0.0] * links.size, [0.0] * 2 * len(self.body.tyres)
        node = system.AddNode(
            item.NodeGenericODE2(
                referenceCoordinates=nothing, initialCoordinates=[q for q, _ in links.start],
                initialCoordinates_t=[v for _, v in links.start], numberOfODE2Coordinates=links.size,
            )
        )  # fmt: skip
        states = system.AddNode(
            item.NodeGenericODE1(
                referenceCoordinates=slips, initialCoordinates=slips, numberOfODE1Coordinates=len(slips)
            )
        )
        kind = exudyn.OutputVariableType

        def force(mbs: Any, t: float, _: int, q: Any, v: Any) -> Any:
            z = np.array(mbs.GetNodeOutput(states, kind.Coordinates))
            return self.forces(t, np.array(q), np.array(v), z).tolist()

        def rates(mbs: Any, t: float, _: int, z: Any) -> Any:
            q, v = (np.array(mbs.GetNodeOutput(node, o)) for o in (kind.Coordinates, kind.Coordinates_t))
            return self.slip_rates(links.frames(q, v), np.array(z)).tolist()

        system.AddObject(
            item.ObjectKinematicTree(
                nodeNumber=node, jointTypes=[getattr(kinds, name) for name in names],
                linkParents=links.parent, jointTransformations=exudyn.Matrix3DList(links.turn),
                jointOffsets=exudyn.Vector3DList(links.offset), linkMasses=links.mass,
                linkInertiasCOM=exudyn.Matrix3DList(links.inertia),
                linkCOMs=exudyn.Vector3DList(links.centre),
                gravity=list(self.body.gravity), forceUserFunction=force,
            )
        )  # fmt: skip
        system.AddObject(
            item.ObjectGenericODE1(
                nodeNumbers=[states], rhsUserFunction=rates, systemMatrix=np.zeros((len(slips), len(slips)))
            )
        )
        sensor = system.AddSensor(
            item.SensorNode(
                nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind.Coordinates
            )
        )
        system.Assemble()
        settings = exudyn.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(t_end / step)
        settings.timeIntegration.endTime = t_end
        settings.timeIntegration.verboseMode = 0
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = every
        assert system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
        found = system.GetSensorStoredData(sensor)
        return found[:, 0], found[:, 1:]


def pacejka(tyre: Any, load: float, slip: float, *, lateral: bool) -> float:
    """Pacejka's formula of 1989, peaks scaled by the friction: force of a pure slip."""
    z, mu = 1e-3 * load, tyre.friction / tyre.reference_friction
    if lateral:
        a = tyre.lateral
        c, d, e = a[0], mu * (a[1] * z * z + a[2] * z), a[6] * z + a[7]
        slope, x = a[3] * np.sin(2.0 * np.arctan(z / a[4])), np.degrees(np.arctan(slip))
    else:
        a = tyre.longitudinal
        c, d, e = a[0], mu * (a[1] * z * z + a[2] * z), a[6] * z * z + a[7] * z + a[8]
        slope, x = (a[3] * z * z + a[4] * z) * np.exp(-a[5] * z), 100.0 * slip
    u = slope / (c * d) * x
    return float(d * np.sin(c * np.arctan(u - e * (u - np.arctan(u)))))

"""The gunner in an independent engine: Exudyn with the same bodies, joints and laws, seen from the cab.

Exudyn's kinematic tree, marched by an explicit Runge-Kutta method of order 4, in the frame of the cab with
the inertia force of braking on every mass centre; ours drives the cab and steps implicitly. Until a grip
slips its law has no memory, so none is modelled there.
"""

from typing import Any

import numpy as np
import pytest

from studies.gunner.cab import braked
from studies.gunner.cases import Case, system
from studies.gunner.figure import FIGURE
from studies.gunner.occupant_responses import shares_of
from workbench.engine import Floating, TreeSystem, Universal, simulate

pytestmark = [pytest.mark.peer, pytest.mark.filterwarnings("ignore::DeprecationWarning")]
T_END, STEPS = 1.0, 2000
G2, PLACES = 0.02, 0.001  # rms of the difference over the range
MOTION = braked(7.0)


def turned_to(axis):
    """A rotation whose third column is the axis."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = np.cross(z, (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0))
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


class Links:
    """Bodies as links of single turns and slides: a massless link for each turn but the last."""

    def __init__(self, exudyn: Any, body: TreeSystem) -> None:
        kinds = exudyn.JointType
        self.rows: list[tuple[Any, ...]] = []  # kind, parent, turn, offset, mass, centre, inertia
        self.last: dict[str, tuple[int, Any]] = {}  # link and its turn against the body's axes
        self.coordinate: dict[tuple[str, int], int] = {}
        for segment in (b for b in body.bodies if b.name != "vehicle"):
            joint, inertia = segment.joint, np.asarray(segment.inertia, float)
            inertia = np.diag(inertia) if inertia.shape == (3,) else inertia
            if isinstance(joint, Floating):
                steps = [(kind, np.eye(3)) for kind in (kinds.PrismaticX, kinds.PrismaticY, kinds.PrismaticZ)]
                steps += [(kind, np.eye(3)) for kind in (kinds.RevoluteZ, kinds.RevoluteY, kinds.RevoluteX)]
                parent, turn, at = -1, np.eye(3), np.asarray(joint.position, float)
            else:
                axes = joint.axes if isinstance(joint, Universal) else (joint.axis,)
                steps = [(kinds.RevoluteZ, turned_to(axis)) for axis in axes]
                (parent, turn), at = self.last[segment.parent], np.asarray(segment.at, float)
            for number, (kind, own) in enumerate(steps):
                full = number == len(steps) - 1
                self.coordinate[segment.name, number] = len(self.rows)
                self.rows.append(
                    (
                        kind, parent, turn.T @ own, turn.T @ at, segment.mass if full else 0.0,
                        own.T @ np.asarray(segment.centre, float) * full, own.T @ inertia @ own * full,
                    )
                )  # fmt: skip
                parent, turn, at = len(self.rows) - 1, own, np.zeros(3)
            self.last[segment.name] = (parent, turn)


def joint_torques(body, links):
    """Generalised forces of all joint springs with their soft stops and constant torques."""
    springs = body.springs
    place = [links.coordinate[s.body, s.coordinate] for s in springs]
    k, c, stop, upper, lower, width, torque = (
        np.array([getattr(s, name) for s in springs])
        for name in ("k", "c", "k_stop", "upper", "lower", "width", "torque")
    )

    def forces(mbs, t, item, q, rate):
        angle, speed = np.array(q)[place], np.array(rate)[place]
        high = width * np.logaddexp(0.0, (angle - upper) / width)
        low = width * np.logaddexp(0.0, (-angle - lower) / width)
        out = np.zeros(len(links.rows))
        out[place] = torque - k * angle - c * speed - stop * (high - low)
        return out.tolist()

    return forces


def bushing_law(bushing):
    """Force of a bushing by separation and its rate, as a spring counts it (positive pulls back)."""

    def law(mbs, t, item, r, v, *rest):
        r, v = np.array(r), np.array(v)
        length = np.sqrt(r @ r + bushing.eps**2)
        cap = bushing.cap
        if bushing.opens is not None:
            opens = np.array(bushing.opens) / np.linalg.norm(bushing.opens)
            x = min(max(-(r @ opens) / length, 0.0), 1.0)
            cap += (bushing.push_cap - bushing.cap) * x**3 * (10 - 15 * x + 6 * x * x)
        u = bushing.k * length / cap
        force = cap * np.tanh(u) / length * r + bushing.c * v / np.cosh(u) ** 2 - np.array(bushing.preload)
        return (bushing.hold * force).tolist()

    return law


def by_exudyn(body):
    """(nodes, 17 x 3): places of the mass centres, seen from the cab."""
    exudyn = pytest.importorskip("exudyn")
    item = pytest.importorskip("exudyn.itemInterface")
    container = exudyn.SystemContainer()
    mbs, links = container.AddSystem(), Links(exudyn, body)
    kind, parent, turn, offset, mass, centre, inertia = zip(*links.rows, strict=True)
    nothing = [0.0] * len(links.rows)
    node = mbs.AddNode(
        item.NodeGenericODE2(
            referenceCoordinates=nothing, initialCoordinates=nothing, initialCoordinates_t=nothing,
            numberOfODE2Coordinates=len(nothing),
        )
    )  # fmt: skip
    tree = mbs.AddObject(
        item.ObjectKinematicTree(
            nodeNumber=node, jointTypes=list(kind), linkParents=list(parent),
            jointTransformations=exudyn.Matrix3DList([np.array(x) for x in turn]),
            jointOffsets=exudyn.Vector3DList([np.array(x) for x in offset]),
            linkInertiasCOM=exudyn.Matrix3DList([np.array(x) for x in inertia]),
            linkCOMs=exudyn.Vector3DList([np.array(x) for x in centre]), linkMasses=list(mass),
            gravity=list(body.gravity), forceUserFunction=joint_torques(body, links),
        )
    )  # fmt: skip
    cab = mbs.AddObject(item.ObjectGround())

    def marker(name, point):
        if name == "vehicle":
            return mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=cab, localPosition=list(point)))
        link, own = links.last[name]
        at = (own.T @ np.asarray(point, float)).tolist()
        return mbs.AddMarker(
            item.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=at)
        )

    sensors = []
    by_name = {b.name: b for b in body.bodies}
    for name in FIGURE:
        own = marker(name, by_name[name].centre)

        def inertia_force(mbs, t, load, m=by_name[name].mass):
            return [-m * MOTION.acceleration(t)[0], 0.0, 0.0]

        mbs.AddLoad(
            item.LoadForceVector(markerNumber=own, loadVector=[0, 0, 0], loadVectorUserFunction=inertia_force)
        )
        sensors.append(
            mbs.AddSensor(
                item.SensorMarker(
                    markerNumber=own, storeInternal=True, writeToFile=False,
                    outputVariableType=exudyn.OutputVariableType.Position,
                )
            )
        )  # fmt: skip
    for bushing in body.bushings:
        ends = [marker(bushing.b, bushing.point_b), marker(bushing.a, bushing.point_a)]
        mbs.AddObject(
            item.ObjectConnectorCartesianSpringDamper(
                markerNumbers=ends, springForceUserFunction=bushing_law(bushing)
            )
        )
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = STEPS
    settings.timeIntegration.endTime = T_END
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = T_END / STEPS
    assert mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
    return np.hstack([mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in sensors])


def ours_of(body):
    """(nodes, 17 x 3) as `by_exudyn`."""
    run = simulate(body, np.zeros(0), t_end=T_END, steps=STEPS)
    assert run.states.max() < 2e-3  # nothing has slipped yet
    cab = run.of("vehicle")
    centre = {b.name: b.centre for b in body.bodies}
    return np.hstack([run.of(name, centre[name]) - cab for name in FIGURE])


def test_path_of_the_gunner_in_a_braked_cab():
    pytest.importorskip("exudyn")
    body = system(Case(on=MOTION))
    ours, theirs = ours_of(body), by_exudyn(body)
    rms, span = np.sqrt(((ours - theirs) ** 2).mean(axis=0)), np.ptp(ours, axis=0)
    moved = span > 1e-3
    worst = (rms[moved] / span[moved]).max()
    shares = np.array(shares_of(body)) / sum(shares_of(body))
    height = [q[:, 2::3] @ shares for q in (ours, theirs)]
    off = np.sqrt(((height[0] - height[1]) ** 2).mean()) / np.ptp(height[0])
    print(f"g2 {100 * off:.4f} %, places up to {100 * worst:.4f} % of their range")
    assert moved.sum() > 30
    assert off < G2
    assert worst < PLACES

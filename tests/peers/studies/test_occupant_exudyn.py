"""The occupant in an independent engine: Exudyn with the same bodies, joints and laws, seen from the vehicle.

Written in the vehicle's frame, with the inertia force of braking as a load, where ours drives the vehicle:
the two share nothing but numbers. Until the grip slips its law has no memory, so none is modelled there.
"""

import numpy as np
import pytest

from studies.occupant import JOINTS, MASSES, SEGMENTS, Case, system
from workbench.engine import simulate

pytestmark = [pytest.mark.peer, pytest.mark.filterwarnings("ignore::DeprecationWarning")]
T_END, STEPS = 1.5, 1500
AGREE = 0.01  # rms of the difference over the range of each signal


def bushing_law(bushing):
    """Force of a bushing by separation and its rate, as a spring counts it (positive pulls back)."""

    def law(mbs, t, item, r, v, *rest):
        r, v = np.array(r[:2]), np.array(v[:2])
        length = np.sqrt(r @ r + bushing.eps**2)
        cap = bushing.cap
        if bushing.opens is not None:
            x = max(0.0, -(r @ np.array(bushing.opens)) / length)
            cap += (bushing.push_cap - bushing.cap) * x**3 * (10 - 15 * x + 6 * x * x)
        u = bushing.k * length / cap
        force = cap * np.tanh(u) / length * r + bushing.c * v / np.cosh(u) ** 2 - np.array(bushing.preload)
        return [*(bushing.hold * force), 0.0]

    return law


def joint_law(spring):
    """Torque of a joint spring with soft stops by its angle and rate."""

    def soft(x):
        return spring.width * np.logaddexp(0.0, x / spring.width)

    def law(mbs, t, item, angle, rate, *rest):
        stops = spring.k_stop * (soft(angle - spring.upper) - soft(-angle - spring.lower))
        return float(spring.k * angle + spring.c * rate + stops)

    return law


def by_exudyn(body):
    """(nodes, 3 bodies): x, y, angle of every segment, seen from the vehicle."""
    exudyn = pytest.importorskip("exudyn")
    item = pytest.importorskip("exudyn.itemInterface")
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    vehicle = next(b for b in body.bodies if b.motion is not None).motion
    ground = mbs.AddObject(item.ObjectGround())
    nodes, objects, sensors, coordinates = {}, {}, [], {}
    for segment in body.free:
        name = segment.name
        nodes[name] = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=list(segment.position)))
        objects[name] = mbs.AddObject(
            item.ObjectRigidBody2D(mass=segment.mass, inertia=segment.inertia, nodeNumber=nodes[name])
        )
        for k in range(3):
            coordinates[name, k] = mbs.AddMarker(
                item.MarkerNodeCoordinate(nodeNumber=nodes[name], coordinate=k)
            )

        def inertia(mbs, t, load, mass=segment.mass):
            return float(-mass * vehicle.push(t)[0])

        mbs.AddLoad(
            item.LoadCoordinate(markerNumber=coordinates[name, 0], load=0.0, loadUserFunction=inertia)
        )
        weight = segment.mass * body.gravity[1]
        mbs.AddLoad(item.LoadCoordinate(markerNumber=coordinates[name, 1], load=weight))
        sensors.append(
            mbs.AddSensor(
                item.SensorNode(
                    nodeNumber=nodes[name], storeInternal=True, writeToFile=False,
                    outputVariableType=exudyn.OutputVariableType.Coordinates,
                )
            )
        )  # fmt: skip

    def marker(name, point):
        number = ground if name == "vehicle" else objects[name]
        return mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=number, localPosition=[*point, 0.0]))

    for joint in body.joints:
        ends = [marker(joint.b, joint.point_b), marker(joint.a, joint.point_a)]
        mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=ends))
    for spring in body.springs:
        mbs.AddObject(
            item.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[coordinates[spring.b, 2], coordinates[spring.a, 2]],
                springForceUserFunction=joint_law(spring),
            )
        )
    for bushing in body.bushings:
        mbs.AddObject(
            item.ObjectConnectorCartesianSpringDamper(
                markerNumbers=[marker("vehicle", bushing.point_b), marker(bushing.a, bushing.point_a)],
                springForceUserFunction=bushing_law(bushing),
            )
        )
    for load in body.loads:
        mbs.AddLoad(item.LoadCoordinate(markerNumber=coordinates[load.body, 2], load=load.torque))
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = STEPS
    settings.timeIntegration.endTime = T_END
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.relativeTolerance = 1e-8
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = T_END / STEPS
    assert mbs.SolveDynamic(settings)
    moved = [mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in sensors]
    start = np.concatenate([segment.position for segment in body.free])
    return np.hstack(moved) + start


def signals(q):
    """(nodes, 2 + joints): path of the mass centre and the joint angles."""
    shares = np.array(MASSES) / sum(MASSES)
    names = list(SEGMENTS)
    centre = [q[:, k::3] @ shares for k in (0, 1)]
    angles = [q[:, 3 * names.index(j.a) + 2] - q[:, 3 * names.index(j.b) + 2] for j in JOINTS.values()]
    return np.stack([*centre, *angles], axis=1)


@pytest.mark.parametrize(
    "case", [Case(), Case(hands=1, grip=600.0, factors={"elbow": 2.0, "hip TX": 0.5}, mass=70.0)]
)
def test_path_of_the_mass_centre_and_joint_angles(case):
    pytest.importorskip("exudyn")
    body = system(case)
    run = simulate(body, body.density(0.0), t_end=T_END, steps=STEPS)
    assert run.damage.max() < 2e-3  # nothing has slipped yet
    ours = run.position.copy()
    ours[:, 0::3] -= run.tables.motion[:, 0, :1]
    theirs = by_exudyn(body)
    a, b = signals(ours), signals(theirs)
    rms = np.sqrt(((a - b) ** 2).mean(axis=0))
    span = np.ptp(a, axis=0)
    print("rms difference over range, %:", (100 * rms / span).round(4))
    assert np.ptp(a[:, 0]) > 0.05
    assert (rms <= AGREE * span).all()

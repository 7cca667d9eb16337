"""What a step costs in bodies: chains, combs, windows of four-bars, beside Exudyn and beside themselves."""

import time

import numpy as np
import pytest

from studies import two_body
from tests.papers.engine.test_mechanisms import four_bars, rod
from workbench.engine import (
    RevoluteJoint,
    SpatialBody,
    Spherical,
    System,
    TreeSystem,
    Welded,
    gradient,
    simulate,
)

pytestmark = pytest.mark.bench

H = 1e-3  # s
LINK = 0.2  # m


def cpu(call):
    begin = time.process_time()
    found = call()
    return found, time.process_time() - begin


def in_turn(calls, rounds):
    """(rounds, calls) processor times of the calls by turns."""
    for call in calls:
        call()
    return np.array([[cpu(call)[1] for call in calls] for _ in range(rounds)])


def branch(count, name="link", at=(0.0, 0.0, 0.0), parent="ground"):
    """Spherical bodies one behind the other, held out level."""
    return tuple(
        SpatialBody(
            name=f"{name}{i}", parent=parent if i == 0 else f"{name}{i - 1}", joint=Spherical(),
            at=at if i == 0 else (LINK, 0.0, 0.0), mass=1.0, centre=(0.5 * LINK, 0.0, 0.0),
            inertia=(1e-3, 4e-3, 4e-3),
        )
        for i in range(count)
    )  # fmt: skip


def comb(branches, count):
    """Branches from one plate."""
    plate = SpatialBody(name="plate", joint=Welded(), mass=1.0)
    teeth = [branch(count, f"b{b}-", (0.0, float(b), 0.0), "plate") for b in range(branches)]
    return TreeSystem(bodies=(plate, *sum(teeth, ())))


def exudyn_chain(count, steps):
    """The same chain in Exudyn with sparse factors, and where its last body ends."""
    exu = pytest.importorskip("exudyn")
    from exudyn.utilities import ObjectGround, RigidBodyInertia

    system = exu.SystemContainer().AddSystem()
    last = system.AddObject(ObjectGround())
    inertia = RigidBodyInertia(mass=1.0, inertiaTensor=np.diag([1e-3, 4e-3, 4e-3]))
    for i in range(count):
        body = system.CreateRigidBody(
            inertia=inertia, referencePosition=[LINK * (i + 0.5), 0, 0], gravity=[0, 0, -9.81]
        )
        system.CreateSphericalJoint(bodyNumbers=[last, body], position=[LINK * i, 0, 0])
        last = body
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = H * steps
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1.0
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    settings.displayStatistics = False

    def go():
        system.SolveDynamic(settings)
        return np.array(system.GetObjectOutputBody(last, exu.OutputVariableType.Position))

    return go


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")
def test_a_spherical_chain_of_50_beside_exudyn():
    steps = 100
    theirs = exudyn_chain(50, steps)
    system = TreeSystem(bodies=branch(50))

    def ours():
        return simulate(system, [], H * steps, steps)

    frames = ours().frames("link49", [steps])
    middle = frames.origin[0] + frames.axes[0] @ (0.5 * LINK, 0.0, 0.0)
    gap = np.abs(theirs() - middle).max()
    seconds = np.median(in_turn((theirs, ours), 3), axis=0) / steps
    print(f"\n  spherical chain of 50, a step, Exudyn sparse {1e6 * seconds[0]:.0f} us")
    print(f"  spherical chain of 50, a step, ours {1e6 * seconds[1]:.0f} us")
    print(f"  {seconds[1] / seconds[0]:.2f} times Exudyn (goal 2); the end differs by {gap:.1e} m")
    assert gap < 1e-6


def test_a_comb_costs_its_branches():
    whole, one, steps = comb(10, 5), comb(1, 5), 200
    seconds = in_turn(
        (lambda: simulate(whole, [], H * steps, steps), lambda: simulate(one, [], H * steps, steps)), 7
    )
    whole_cost, one_cost = np.median(seconds, axis=0) / steps
    ratio = np.median(seconds[:, 0] / seconds[:, 1])
    print(f"\n  comb of 10 branches of 5 bodies, a step {1e6 * whole_cost:.0f} us")
    print(f"  comb of 1 branch of 5 bodies, a step {1e6 * one_cost:.0f} us")
    print(f"  {ratio / 10:.2f} times ten of one branch, {ratio / 5:.2f} times five (goal 1.3)")


def planar_chain(count):
    """Rods one behind the other, held out level, on pins."""
    bodies, joints = [], []
    for i in range(count):
        bar, _ = rod(f"bar{i}", (LINK * i, 0.0), (LINK * (i + 1), 0.0))
        half = 0.5 * LINK
        bodies.append(bar)
        end = {"b": "ground"} if i == 0 else {"b": f"bar{i - 1}", "point_b": (half, 0.0)}
        joints.append(RevoluteJoint(a=f"bar{i}", point_a=(-half, 0.0), **end))
    return System(bodies=bodies, joints=joints, gravity=(0.0, -9.81))


@pytest.mark.parametrize(
    ("name", "system", "h", "goal"),
    [
        ("four-bar with 40 links", four_bars(40), 5e-3, 0.4),
        ("chain of 50 bodies", planar_chain(50), 1e-3, 0.3),
    ],
)
def test_planar_systems_of_many_joints(name, system, h, goal):
    steps = 200
    simulate(system, [], h * 2, 2)
    run, seconds = cpu(lambda: simulate(system, [], h * steps, steps))
    newton = run.diagnosis.newton_iterations / steps
    print(f"\n  planar {name}, a step {1e3 * seconds / steps:.3f} ms")
    print(
        f"  goal {goal} ms; {newton:.1f} Newton steps and {run.diagnosis.factorisations / steps:.2f} factors"
    )


def test_gradient_over_forward_at_1020_members():
    p = two_body.problem("C")

    def forward():
        return simulate(p.system, p.density, p.t_end, 200)

    def both():
        return gradient(p.system, p.density, forward(), p.objective)

    seconds = in_turn((forward, both), 15)
    print(f"\n  1020 members, 200 steps, forward {1e3 * np.median(seconds[:, 0]):.3f} ms")
    print(f"  (forward + gradient)/forward {np.median(seconds[:, 1] / seconds[:, 0]):.2f} (goal 1.6)")

"""Bricard's mechanism in Exudyn (absolute coordinates, index 3) and in natural coordinates."""

import warnings

import numpy as np
import pytest

from tests.sample_spatial import bricard
from workbench.engine import RungeKutta8, simulate

pytestmark = pytest.mark.peer

AGREE = 1e-6  # m, Richardson of two runs of second order


def exudyn_path(step, t_end):
    """P3 at every half second, (k, 4) with the time first; modelled as in Exudyn's own test."""
    exu = pytest.importorskip("exudyn")
    from exudyn.utilities import (
        InertiaCuboid,
        ObjectGround,
        RotationMatrixY,
        RotationMatrixZ,
        SensorBody,
    )

    system = exu.SystemContainer().AddSystem()
    inertia = InertiaCuboid(density=100, sideLengths=[1, 0.1, 0.1]).Translated([0.5, 0, 0])
    places = [[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]]
    half = np.pi / 2
    turns = [
        np.eye(3), RotationMatrixZ(-half), RotationMatrixY(-half), RotationMatrixZ(np.pi),
        RotationMatrixZ(half),
    ]  # fmt: skip
    axes = [[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    ground = system.AddObject(ObjectGround())
    bodies = [ground]
    for place, turn, axis in zip(places, turns, axes, strict=False):
        bodies.append(
            system.CreateRigidBody(
                inertia=inertia, referencePosition=place, referenceRotationMatrix=turn, gravity=[0, -9.81, 0]
            )
        )
        system.CreateRevoluteJoint(bodyNumbers=bodies[-2:], position=place, axis=axis)
    # the last joint without its redundant row
    system.CreateGenericJoint(
        bodyNumbers=[bodies[-1], ground], position=places[5], constrainedAxes=[1, 1, 1, 0, 1, 1]
    )
    sensor = system.AddSensor(
        SensorBody(
            bodyNumber=bodies[4], localPosition=[0, 0, 0], storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )  # fmt: skip
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(t_end / step)
    settings.timeIntegration.endTime = t_end
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-8
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 0.5
    settings.linearSolverType = exu.LinearSolverType.EigenDense
    settings.linearSolverSettings.ignoreSingularJacobian = True
    system.SolveDynamic(settings)
    return system.GetSensorStoredData(sensor)


def test_bricard_moves_as_in_exudyn():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        coarse, fine = (exudyn_path(step, 5.0) for step in (1e-3, 5e-4))
    theirs = (4 * fine[1:] - coarse[1:]) / 3
    run = simulate(bricard(), [], 5.0, 250, scheme=RungeKutta8())
    np.testing.assert_allclose(run.of("P3")[25::25], theirs[-10:, 1:], atol=AGREE)

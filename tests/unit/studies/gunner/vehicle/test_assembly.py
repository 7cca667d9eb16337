"""The vehicle at rest and rolling straight on."""

import numpy as np
import pytest

from studies.gunner.manoeuvre import Ground, Manoeuvre
from studies.gunner.parameters import read
from studies.gunner.parts import Parts, joined
from studies.gunner.proving_grounds import rollover
from studies.gunner.vehicle.assembly import vehicle
from studies.gunner.vehicle.numbers import Payload, VehicleParameters, wheel_loads
from workbench.engine import Prescribed, SpatialBody, Welded, simulate

GUNNER = Payload(mass=77.0, at=(-1.848, -0.041, 1.758))


@pytest.fixture(scope="module")
def parameters():
    return read(VehicleParameters, "vehicle")


def test_wheel_loads_without_and_with_gunner(parameters):  # V1: the note's, 0.5 %
    front, rear = wheel_loads(parameters).reshape(2, 2).mean(axis=1)
    assert (front, rear) == pytest.approx((6755.0, 7082.0), rel=5e-3)
    front, rear = wheel_loads(parameters, [GUNNER]).reshape(2, 2).mean(axis=1)
    assert (front, rear) == pytest.approx((6922.0, 7292.0), rel=5e-3)


def test_mass_and_centre_are_those_of_the_table(parameters):  # V2: Table 8.2
    system = joined(vehicle(parameters, Ground(), Manoeuvre()))
    run = simulate(system, np.zeros(0), t_end=0.002, steps=2)
    mass = np.array([body.mass for body in system.bodies])
    centres = np.array([run.of(body.name, body.centre)[0] for body in system.bodies])
    assert mass.sum() == pytest.approx(2821.0, rel=1e-12)
    assert mass @ centres / mass.sum() == pytest.approx((-1.69, -0.0005, 0.77), rel=1e-6)


@pytest.mark.parametrize(("payload", "left"), [((), 1e-8), ((GUNNER,), 3e-4)])
def test_it_starts_in_equilibrium(parameters, payload, left):
    """Preloads carry vehicle and payload; left over is what half a millimetre of travel widens the track."""
    parts = vehicle(parameters, Ground(), Manoeuvre(), payload=payload)
    carried = tuple(
        SpatialBody(name="gunner", parent="vehicle", joint=Welded(), at=p.at, mass=p.mass) for p in payload
    )
    system = joined(parts, Parts(bodies=carried))
    run = simulate(system, np.zeros(0), t_end=0.02, steps=20)
    assert np.abs(run.acceleration).max() < left


def test_front_wheels_that_turn_alike_are_one_motion(parameters):
    """Cases that differ in the road or in the gunner share what a motion keeps of its samples."""

    def motion(ground):
        bodies = {body.name: body for body in vehicle(parameters, ground.ground, ground.manoeuvre).bodies}
        return next(body.joint.motion for body in bodies.values() if isinstance(body.joint, Prescribed))

    assert motion(rollover(friction=1.15)) is motion(rollover(friction=1.3))
    assert motion(rollover(turn=700.0)) is not motion(rollover())

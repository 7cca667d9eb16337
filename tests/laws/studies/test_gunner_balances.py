"""Energy and momentum of the vehicle on grounds and manoeuvres that stand in no table."""

from dataclasses import replace

import numpy as np
import pytest

from studies.gunner.manoeuvre import Ground, Manoeuvre, smooth_step
from studies.gunner.parameters import read
from studies.gunner.parts import joined
from studies.gunner.vehicle.assembly import vehicle
from studies.gunner.vehicle.balances import energies, momentum_gap
from studies.gunner.vehicle.numbers import VehicleParameters
from workbench.engine import Road, simulate

WAVES = Road(amplitude=0.02, wavelength=5.0, start=2.0, ramp=4.0, heading=0.3)
TURN = smooth_step(start=0.1, duration=0.3, height=1.5)
STOP = smooth_step(start=0.2, duration=0.1, height=4.0)
CASES = {
    "brake on a slippery road": (Ground(friction=0.35), Manoeuvre(speed=13.0, braking=STOP)),
    "waves askew": (Ground(road=WAVES, friction=0.7), Manoeuvre(speed=14.0)),
    "turn": (Ground(friction=0.6), Manoeuvre(speed=22.0, steering=TURN)),
    "turn and brake over waves": (Ground(road=WAVES), Manoeuvre(speed=12.0, steering=TURN, braking=STOP)),
    "drift": (Ground(friction=0.5), Manoeuvre(speed=8.0, drift=2.0)),
}


@pytest.mark.parametrize("name", CASES)
def test_momentum_and_energy_are_accounted_for(name):
    """The driver's work at the steering wheel is not counted: it is what may be missing where he steers."""
    parameters = read(VehicleParameters, "vehicle")
    own = replace(parameters, steering=replace(parameters.steering, ratio=21.0))
    ground, manoeuvre = CASES[name]
    system = joined(vehicle(own, ground, manoeuvre))
    run = simulate(system, np.zeros(0), t_end=1.2, steps=600)
    momentum = run.momentum()[:, 3:]
    size = np.abs(momentum - momentum[0]).max()
    assert np.abs(momentum_gap(run)).max() < 0.01 * size
    found = energies(run)
    exchanged = max(np.abs(part).max() for part in (found.kinetic, found.dampers, found.brakes, found.tyres))
    assert np.abs(found.gap).max() < 0.01 * exchanged

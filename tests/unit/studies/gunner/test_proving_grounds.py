"""Short runs of the vehicle on its proving grounds: one compiled system, what a second shows."""

import numpy as np
import pytest

from studies.gunner.parameters import read
from studies.gunner.parts import joined
from studies.gunner.proving_grounds import braking, kerb_trip, rough, step_steer
from studies.gunner.vehicle.assembly import vehicle
from studies.gunner.vehicle.numbers import VehicleParameters
from studies.gunner.vehicle.states import vehicle_responses, vehicle_states
from workbench.engine import simulate


@pytest.fixture(scope="module")
def parameters():
    return read(VehicleParameters, "vehicle")


def states_on(parameters, proving_ground, t_end, step=2e-3):
    system = joined(vehicle(parameters, proving_ground.ground, proving_ground.manoeuvre))
    return vehicle_states(simulate(system, np.zeros(0), t_end=t_end, steps=round(t_end / step)))


def test_braking_takes_the_asked_speed_and_moves_the_load(parameters):  # V10
    states = states_on(parameters, braking(start=0.1), 1.5)
    settled = states.time > 0.9
    assert -states.forward[settled].mean() == pytest.approx(7.0, abs=0.1)
    shift = states.wheel_loads[settled].mean(axis=0) - states.wheel_loads[0]
    assert shift == pytest.approx(np.array([1, 1, -1, -1]) * 2821.0 * 7.0 * 0.77 / (2.0 * 3.302), rel=0.05)
    assert states.pitch[-1] > 0.0  # nose down


def test_a_left_turn_rolls_it_to_the_right(parameters):
    states = states_on(parameters, step_steer(turn=90.0, within=0.3), 1.2)
    assert states.yaw[-1] > 0.3
    assert states.lateral[-1] > 3.0
    assert states.roll[-1] > np.radians(1.0)
    left, right = states.wheel_loads[-1, ::2].sum(), states.wheel_loads[-1, 1::2].sum()
    assert right > 1.3 * left


def test_waves_lift_it_and_a_kerb_stops_its_slide(parameters):
    states = states_on(parameters, rough(amplitude=0.03), 1.2)
    assert 0.01 < np.ptp(states.heave) < 0.06
    states = states_on(parameters, kerb_trip(drift=3.0), 0.6, step=1e-3)
    found = vehicle_responses(states)
    assert found["peak roll"] > 5.0
    assert found["tipped over"] == float("inf")
    assert abs(states.drift[-1]) < 1.0
    assert found["first wheel lift"] < 0.3

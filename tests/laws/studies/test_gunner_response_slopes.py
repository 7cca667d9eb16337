"""Every response of gunner and vehicle by every kind of parameter over 1 s at L0, against differences."""

import numpy as np
import pytest

from studies.gunner.cases import system
from studies.gunner.occupant_responses import responses_of
from studies.gunner.slopes.responses import SCHEME, SLOPED, response_slopes, value_of, vehicle_objectives
from studies.gunner.uncertain import case_of
from workbench.engine import simulate

pytestmark = pytest.mark.slow

# one weak hand and a weak seat: in a second of steering he loses both
WEAK = {"hands": "one", "grip": 130.0, "seat_cap": 300.0, "mass": 95.0, "seat_rate": 5e3}
KINDS = {
    "grip": ("grip",), "joints": ("k_elbow", "k_hip_tx", "k_shoulder_tz"),
    "seat": ("seat_rate", "seat_damping", "seat_cap"), "mass": ("mass",), "road": ("friction",),
    "steering": ("turn",),
}  # fmt: skip
BRAKED = {"hands": "one", "grip": 130.0, "deceleration": 8.0}
ALWAYS = tuple(name for name, how in SLOPED.items() if not how.event)
BRAKING = ("deceleration", "grip", "k_hip_tx", "friction")
# of a parameter; the grip acts by 1e-8 and less, which the rounding of coordinates of tens of metres hides
MOVE, LONGER = 1e-4, {"grip": 1e-3}
SLOPE = 1e-6
FLOOR = 1e-8  # of the response: what differences resolve where a parameter hardly acts
# the interval of HIC ends at nodes, and the level of the chest lies between two of them: where they change
# over to others, the response has a corner
CORNERS = {"hic15": 1e-3, "chest_3ms": 1e-4}


def values(name, row, t_end=1.0):
    run = simulate(system(case_of(name, row)), np.zeros(0), t_end, round(1e3 * t_end), scheme=SCHEME)
    return responses_of(run) | {key: float(one.value(run)) for key, one in vehicle_objectives().items()}


def differences(name, row, parameter, t_end, move):
    """Slopes of all responses by the logarithm of a parameter, of fourth order."""
    at = value_of(name, row, parameter)
    a, b, c, d = (values(name, {**row, parameter: at * (1.0 + move * k)}, t_end) for k in (-2, -1, 1, 2))
    return {key: (8.0 * (c[key] - b[key]) - (d[key] - a[key])) / (12.0 * move) for key in a}


def agree(name, row, responses, parameters, t_end=1.0, times=1.0):
    found, level = response_slopes(name, row, responses, parameters, t_end=t_end), values(name, row, t_end)
    for parameter in parameters:
        at, move = value_of(name, row, parameter), times * LONGER.get(parameter, MOVE)
        expected = differences(name, row, parameter, t_end, move)
        for response in responses:
            near = pytest.approx(
                expected[response], rel=CORNERS.get(response, SLOPE), abs=FLOOR * abs(level[response])
            )
            assert found[response][parameter] * at == near, (response, parameter)


@pytest.mark.parametrize("kind", KINDS)
def test_a_second_of_steering(kind):
    """Grip and seat are lost in it, so their times have slopes."""
    agree("step steer", WEAK, (*ALWAYS, "grip_lost_at", "seat_lost_at"), KINDS[kind])


def test_a_second_of_braking():
    others = tuple(name for name in ALWAYS if name != "final_yaw")
    agree("braking", BRAKED, others, BRAKING)


def test_the_yaw_of_a_second_of_braking():
    """It is 6e-5 rad, rounded as a whole turn is: differences tell its slopes over longer moves alone."""
    agree("braking", BRAKED, ("final_yaw",), BRAKING, times=3)


def test_the_time_of_ejection_in_the_rollover():
    """Over 2.7 s: he is thrown out at 2.6 s. Moves are short: a crossing that passes a node has a corner."""
    agree("rollover", {}, ("ejected_at", "seat_lost_at"), ("mass", "friction"), t_end=2.7, times=0.1)

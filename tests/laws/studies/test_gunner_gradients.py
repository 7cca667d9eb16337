"""Slopes of the gunner's responses over 1 s are those of differences, in the cab and on the vehicle."""

from dataclasses import replace

import numpy as np
import pytest

from studies.gunner.cab import braked
from studies.gunner.cases import Case, system
from studies.gunner.occupant_responses import objectives
from studies.gunner.uncertain import case_of
from workbench.engine import GeneralisedAlpha, parameter_slopes, simulate

pytestmark = pytest.mark.slow

SCHEME = GeneralisedAlpha(tolerance=1e-13)
# one weak hand: it slips and is lost, so that the grip decides
CASE = Case(on=braked(8.0), hands="one", grip=130.0, seat_rate=1e4, seat_cap=1000.0, mass=77.0)
PARAMETERS = {
    "grip": (130.0, lambda x: system(replace(CASE, grip=x))),
    "elbow": (1.0, lambda x: system(replace(CASE, factors={"elbow": x}))),
    "hip_tx": (1.0, lambda x: system(replace(CASE, factors={"hip_tx": x}))),
    "seat_rate": (1e4, lambda x: system(replace(CASE, seat_rate=x))),
    "mass": (77.0, lambda x: system(replace(CASE, mass=x))),
}
LAWS = (
    "g1", "smooth_g1", "highest", "smooth_rise", "right_grip_lost_at", "head_speed", "smooth_head_speed",
    "head_speed_rms", "hic15", "chest_3ms", "comfort", "health_y",
)  # fmt: skip
# others 1e-6; the interval of the criterion moves by whole steps, so differences meet corners
DIFFERENCES = {"hic15": 1e-2}
FLOOR = 1e-8  # of the response: what differences resolve of a parameter that does not act


def run_of(system):
    return simulate(system, np.zeros(0), t_end=1.0, steps=1000, scheme=SCHEME)


@pytest.fixture(scope="module")
def run():
    return run_of(system(CASE))


@pytest.fixture(scope="module")
def around():
    """Value of every objective at four values of every parameter, steps of 1e-4."""
    ask = objectives(system(CASE), t_end=1.0)
    return {
        name: [
            {key: ask[key].value(moved) for key in LAWS}
            for moved in (run_of(at(value * (1.0 + 1e-4 * k))) for k in (-2, -1, 1, 2))
        ]
        for name, (value, at) in PARAMETERS.items()
    }


@pytest.mark.parametrize("name", LAWS)
def test_slopes_are_those_of_differences(run, around, name):
    objective = objectives(run.system, t_end=1.0)[name]
    found = parameter_slopes(run, objective, PARAMETERS)
    level = abs(objective.value(run))
    for parameter, (value, _) in PARAMETERS.items():
        a, b, c, d = (values[name] for values in around[parameter])
        expected = (8.0 * (c - b) - (d - a)) / 12e-4  # by the logarithm of the parameter
        near = pytest.approx(expected, rel=DIFFERENCES.get(name, 1e-6), abs=FLOOR * level)
        assert found[parameter] * value == near, parameter


@pytest.mark.parametrize(
    ("name", "value"), [("k_elbow", 1.0), ("seat_rate", 1e4), ("mass", 77.0), ("friction", 0.8)]
)
def test_slopes_on_the_steered_vehicle_are_those_of_differences(name, value):
    def at(x):
        return system(case_of("step steer", {name: x}))

    ran = run_of(at(value))
    moved = [run_of(at(value * (1.0 + 1e-4 * k))) for k in (-2, -1, 1, 2)]
    for key in ("g1", "smooth_g1"):
        objective = objectives(ran.system, t_end=1.0)[key]
        a, b, c, d = (objective.value(one) for one in moved)
        expected = (8.0 * (c - b) - (d - a)) / 12e-4
        found = parameter_slopes(ran, objective, {name: (value, at)})[name]
        assert found * value == pytest.approx(expected, rel=1e-6), key

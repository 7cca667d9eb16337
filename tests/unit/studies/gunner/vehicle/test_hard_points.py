"""Double wishbones against a table solved by another program from the same points, and against arithmetic."""

import numpy as np
import pytest

from studies.gunner.vehicle.hard_points import Wishbones, wishbones

# axle, travel m, camber deg, steer deg, spring length m, wheel force N, wheel rate N/m
TABLE = (
    ("front", 0.0, 0.0, 0.0, 0.2465, 6985.0, 30902.0),
    ("front", 0.0909, -2.979, 0.279, 0.2060, 9779.0, 30875.0),
    ("front", -0.0837, 1.095, -0.771, 0.2853, 4318.0, 33562.0),
    ("rear", 0.0, 0.0, 0.0, 0.3060, 12318.0, 66302.0),
    ("rear", 0.0936, -4.070, -0.099, 0.2655, 18418.0, 64686.0),
    ("rear", -0.0862, 2.181, 0.229, 0.3448, 6374.0, 73259.0),
)


@pytest.mark.parametrize(("axle", "travel", "camber", "steer", "spring", "force", "rate"), TABLE)
def test_positions_and_forces_are_those_of_the_table(axle, travel, camber, steer, spring, force, rate):
    bones = wishbones(axle)
    corner = bones.at(bones.angle_at(travel))
    assert corner.centre[2] - bones.points["SP"][2] == pytest.approx(travel, abs=1e-12)
    assert (corner.camber, corner.steer) == pytest.approx((camber, steer), abs=4e-3)
    assert corner.spring == pytest.approx(spring, abs=1e-4)
    assert bones.wheel_force(travel) == pytest.approx(force, rel=1e-3)
    assert bones.wheel_rate(travel) == pytest.approx(rate, rel=5e-3)


def test_parallel_arms_of_equal_length_neither_camber_nor_steer():
    points = {
        "UF": (0.1, 0.3, 0.3), "UB": (-0.1, 0.3, 0.3), "UU": (0.0, 0.7, 0.3), "LF": (0.1, 0.3, 0.0),
        "LB": (-0.1, 0.3, 0.0), "LU": (0.0, 0.7, 0.0), "TC": (-0.2, 0.3, 0.1), "TU": (-0.2, 0.7, 0.1),
        "SA": (0.0, 0.5, 0.0), "SC": (0.0, 0.5, 0.4), "SP": (0.0, 0.8, 0.1),
    }  # fmt: skip
    bones = Wishbones(axle="front", points={name: np.array(at) for name, at in points.items()})
    corner = bones.at(0.2)
    assert (corner.camber, corner.steer) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert corner.centre - bones.points["SP"] == pytest.approx(
        0.4 * np.array([0.0, np.cos(0.2) - 1.0, np.sin(0.2)]), abs=1e-12
    )
    assert bones.slopes()[2] == pytest.approx(0.5, abs=1e-6)  # the spring stands half way out

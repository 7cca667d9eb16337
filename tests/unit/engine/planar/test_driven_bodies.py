"""Points of a driven body in the plane: their motion is the given one, asked once for all of them."""

import numpy as np

from workbench.engine import Body, Motion, System, simulate

TIMES = np.linspace(0.0, 1.0, 101)


def test_points_of_a_turning_body_go_round_and_its_motion_is_asked_once():
    asked = []

    def acceleration(t):
        asked.append(t)
        return (2.0, 0.0, 0.0)

    turned = Motion(
        position=lambda t: (t**2, 0.0, 3.0 * t), velocity=lambda t: (2.0 * t, 0.0, 3.0),
        acceleration=acceleration,
    )  # fmt: skip
    table = Body(name="table", motion=turned)
    mass = Body(name="mass", mass=1.0, inertia=0.1)
    trajectory = simulate(System(bodies=(mass, table)), [], t_end=1.0, steps=100)
    before = len(asked)
    for radius in (0.5, 1.0):
        point = trajectory.point_series("table", (radius, 0.0))
        cosine, sine = np.cos(3.0 * TIMES), np.sin(3.0 * TIMES)
        np.testing.assert_allclose(point.place, np.c_[TIMES**2 + radius * cosine, radius * sine], atol=1e-12)
        inwards = -9.0 * radius * np.c_[cosine, sine] + [2.0, 0.0]
        np.testing.assert_allclose(point.acceleration, inwards, atol=1e-12)
    assert len(asked) - before == len(TIMES)

"""Ground that is not flat is drawn as high as it carries the wheels, and everything on it."""

import numpy as np
import pytest
from numba import njit

from studies.gunner.cases import Case, system
from studies.gunner.drawing.bodies import motion_of
from studies.gunner.drawing.road import depth
from studies.gunner.proving_grounds import braking, kerb_trip, rough
from workbench.engine import Road, simulate
from workbench.engine.elements._kernels_tyre import road as road_of_the_kernel


@njit
def height_of_the_kernel(numbers, x, y):
    return road_of_the_kernel(numbers, x, y, np.zeros(2))


def test_the_height_is_that_of_the_kernel():
    rng = np.random.default_rng(5)
    road = Road(
        amplitude=0.1, wavelength=7.0, heading=0.3, start=1.0, ramp=9.0, waves=((0.02, 2.0, 0.4),),
        kerb_height=0.15, kerb_at=4.0, kerb_heading=1.2, kerb_width=0.5,
    )  # fmt: skip
    for x, y in rng.uniform(-15.0, 15.0, (40, 2)):
        assert road.height(x, y) == pytest.approx(
            height_of_the_kernel(np.array(road.numbers()), x, y), abs=1e-13
        )


def motion(ground, t_end=0.02):
    case = Case(on=ground)
    return motion_of({"run": simulate(system(case), np.zeros(0), t_end, 20)}, case, title="a ground")


def test_waves_lie_under_the_wheels():
    ground = rough(amplitude=0.05)
    run = motion(ground).runs[0]
    names = [body.name for body in run.bodies]
    strip = np.array(run.bodies[names.index("road")].vertices)
    low = depth(ground.ground.road)
    for x, y, z in strip[:: len(strip) // 9]:
        assert z == pytest.approx(ground.ground.road.height(x, y) + low, abs=1e-12)
        assert z >= 0.0  # over the ground of the viewer
    assert strip[:, 0].max() > 5.0  # ahead of the vehicle
    assert strip[:, 0].min() < -4.5  # and behind it
    wheel = run.poses[0, names.index("front left wheel")]
    assert wheel[2] == pytest.approx(0.46 + low, abs=0.03)  # lifted with the road, on which it stands
    assert (run.poses[:, names.index("road")] == (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)).all()


def test_a_kerb_is_a_box_and_a_plane_is_left_to_the_viewer():
    names = [body.name for body in motion(kerb_trip()).runs[0].bodies]
    assert "obstacle 0" in names
    assert "road" not in names
    run = motion(braking()).runs[0]
    assert not {"road", "obstacle 0"} & {body.name for body in run.bodies}

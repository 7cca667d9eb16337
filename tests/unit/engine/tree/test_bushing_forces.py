"""The force of a bushing along a run: on a single body it is mass times acceleration less the weight."""

import numpy as np
import pytest

from workbench.engine import Floating, SpatialBody, SpatialBushing, TreeSystem, simulate


def test_the_force_is_mass_times_acceleration_less_the_weight():
    ball = SpatialBody(name="ball", joint=Floating(velocity=(0.5, 0.1, -0.3)), mass=2.0, inertia=(0.1,) * 3)
    hold = SpatialBushing(
        a="ball", k=(900.0, 700.0, 800.0), c=3.0, cap=30.0, slip=0.01, release=0.2, preload=(0.0, 0.0, 20.0),
        opens=(1.0, 0.0, 0.0), push_cap=50.0, name="hold",
    )  # fmt: skip
    run = simulate(TreeSystem(bodies=(ball,), bushings=(hold,)), np.zeros(0), t_end=0.2, steps=200)
    force = 2.0 * (run.acceleration[:, :3] + np.array([0.0, 0.0, 9.81]))
    # nodal forces: generalised-alpha solves the equations between nodes, so they agree to second order
    assert run.bushing_force("hold")[1:] == pytest.approx(force[1:], abs=2e-3 * np.abs(force).max())
    with pytest.raises(ValueError, match="system has no bushing 'seat'; it has hold"):
        run.bushing_force("seat")

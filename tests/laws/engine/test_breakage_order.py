"""A bushing of the plane that breaks in a run leaves generalised-alpha its order."""

import numpy as np
import pytest

from workbench.engine import Body, Bushing, Load, System, simulate

ORDER = 0.1  # the first doubling still holds a little of the next order


@pytest.mark.parametrize(("width", "tau"), [(5e-3, 0.02), (5e-4, 0.02), (5e-3, 2e-3)])
def test_a_bushing_that_breaks_leaves_order_two(width, tau):
    body = Body(name="a", mass=1.0, inertia=0.1, gravity=False)
    grip = Bushing(
        a="a", b="ground", k=2000.0, c=2.0, cap=60.0, slip=0.01, release=0.05, width=width, tau=tau
    )
    system = System(bodies=(body,), bushings=(grip,), loads=(Load(body="a", force=(80.0, 10.0)),))
    true = simulate(system, [], 0.3, 25_600)
    assert true.states[0, 0] < 1e-3
    assert true.states[-1, 0] > 0.99
    steps = [200, 400, 800, 1600]
    off = [np.abs(simulate(system, [], 0.3, n).position[-1] - true.position[-1]).max() for n in steps]
    assert -np.polyfit(np.log(steps), np.log(off), 1)[0] == pytest.approx(2.0, abs=ORDER)

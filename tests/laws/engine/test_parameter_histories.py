"""Slopes of histories by parameters equal differences of runs, in every kind of system."""

import numpy as np
import pytest

from tests.sample_masses import DENSITY, along_x, natural, planar, run_of, tree
from workbench.engine import AtTime, Spring, parameter_histories, simulate


def spring(k):
    return Spring(k=k, c=2.0)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_slopes_over_time_are_those_of_runs(system):
    quantity = along_x(system)
    run = run_of(system, spring(300.0))
    times, slopes = parameter_histories(run, quantity, {"k": (300.0, lambda k: system(spring(k)))})
    up, down = (run_of(system, spring(300.0 + h)) for h in (0.01, -0.01))
    exact = [
        (AtTime(quantity=quantity, time=t).value(up) - AtTime(quantity=quantity, time=t).value(down)) / 0.02
        for t in times
    ]
    assert len(times) == 51
    np.testing.assert_allclose(slopes["k"], exact, rtol=0, atol=1e-7 * np.abs(exact).max())


def test_times_of_ones_own_lie_in_the_run():
    run, quantity = simulate(planar(spring(300.0)), DENSITY, 0.1, 20), along_x(planar)
    by_stiffness = {"k": (300.0, lambda k: planar(spring(k)))}
    times, slopes = parameter_histories(run, quantity, by_stiffness, times=[0.0, 0.0512])
    assert times.tolist() == [0.0, 0.0512]
    assert slopes["k"][0] == 0.0
    with pytest.raises(ValueError, match=r"time needs to lie in the run, 0 to 0\.1 s, got 0\.2"):
        parameter_histories(run, quantity, by_stiffness, times=[0.2])

"""What the occupant costs: a run of 2 s, and its gradient by 360 densities. Printed only."""

import numpy as np
import pytest

from studies.occupant_braking import DEVIATION, NOMINAL, STEPS, T_END, restraint
from workbench.engine import Maximum, gradient, simulate

pytestmark = pytest.mark.bench


@pytest.fixture(scope="module")
def restrained():
    model = restraint()
    return model.system(NOMINAL), np.full(model.members, 0.03)


def test_run(benchmark, restrained):
    system, density = restrained
    found = benchmark(lambda: simulate(system, density, t_end=T_END, steps=STEPS))
    print(f"\n{benchmark.stats['median'] / T_END:.4f} s per simulated second")
    assert np.isfinite(found.position).all()


def test_gradient(benchmark, restrained):
    system, density = restrained
    objective = Maximum(quantity=DEVIATION)
    trajectory = simulate(system, density, t_end=T_END, steps=STEPS)
    found = benchmark(lambda: gradient(system, density, trajectory, objective))
    print(f"\n{benchmark.stats['median']:.4f} s for the gradient of {len(density)} densities")
    assert np.isfinite(found).all()

"""What the occupant costs: a run of 2 s, its gradient by 360 densities, the rows of a layout step."""

import time

import numpy as np
import pytest

from studies.occupant_braking import DEVIATION, NOMINAL, STEPS, T_END, responses_of, restraint
from workbench.engine import AtTime, Maximum, gradient, gradients, optimise_layout, simulate

pytestmark = pytest.mark.bench

CASES = (NOMINAL, {**NOMINAL, "hands": "one", "grip": 400.0, "deceleration": 9.0})


@pytest.fixture(scope="module")
def restrained():
    model = restraint()
    return model.system(NOMINAL), np.full(model.members, 0.03)


def cpu(call, repeats=5):
    call()
    best = np.inf
    for _ in range(repeats):
        begin = time.process_time()
        found = call()
        best = min(best, time.process_time() - begin)
    return found, best


def test_run_and_gradient(restrained):
    system, density = restrained
    objective = Maximum(quantity=DEVIATION)
    trajectory, forward = cpu(lambda: simulate(system, density, t_end=T_END, steps=STEPS))
    found, backward = cpu(lambda: gradient(system, density, trajectory, objective))
    print(f"\n  {'one simulated second of the occupant':44s} {forward / T_END:.4f} s   (goal 0.1)")
    both = (forward + backward) / T_END
    print(f"  {f'with the gradient of {len(density)} densities':44s} {both:.4f} s   (goal 0.2)")
    assert np.isfinite(found).all()


def test_run_of_the_members_that_act():
    """An optimised layout has a few dozen members: its run with all 360 candidates beside that of these."""
    model = restraint()
    density = np.full(model.members, 1e-9)
    density[:: model.members // 36] = 0.5
    whole, before = cpu(lambda: responses_of(model.run(density, NOMINAL)))
    part, after = cpu(lambda: model.responses(density, NOMINAL))
    print(f"\n  run with {model.members} members / with those that act: {before / after:.2f}   (goal 1.5)")
    for name, value in whole.items():
        assert part[name] == pytest.approx(value, rel=1e-6), name


def test_rows_of_one_sweep(restrained):
    system, density = restrained
    trajectory = simulate(system, density, t_end=T_END, steps=STEPS)
    times = np.linspace(0.6, 1.98, 35)
    objectives = [AtTime(quantity=DEVIATION, time=float(t)) for t in times]
    singles, apart = cpu(lambda: [gradient(system, density, trajectory, g) for g in objectives], 2)
    rows, together = cpu(lambda: gradients(system, density, trajectory, objectives), 2)
    print(f"\n  35 gradients one by one {1e3 * apart:.0f} ms, in one sweep {1e3 * together:.0f} ms")
    np.testing.assert_allclose(rows, singles, rtol=1e-10, atol=1e-16)


def test_layout_step():
    problem = restraint().problem(CASES)
    optimise_layout(problem, max_evaluations=2)
    begin = time.process_time()
    result = optimise_layout(problem, max_evaluations=30)
    each = (time.process_time() - begin) / len(result.history)
    print(f"\n  layout of two cases: {1e3 * each:.0f} ms of processor time per evaluation")

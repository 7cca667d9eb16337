"""What the occupant costs: a run of 2 s, its gradient by 360 densities, the rows of a layout step."""

import time
from importlib.resources import files

import numpy as np
import psutil
import pytest

from studies.occupant_braking import DEVIATION, NOMINAL, STEPS, T_END, responses_of, restraint
from workbench.engine import AtTime, Maximum, gradient, gradients, optimise_layout, simulate
from workbench.models.protocol import ModelSpec
from workbench.robust_layout.runs import LayoutRuns
from workbench.study.loading import load_study

pytestmark = pytest.mark.bench

COARSE = 250  # steps of 8 ms, four times those of the demo

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


def processor_time():
    """Seconds of this process and of all that it has started and that live."""
    here = psutil.Process()
    return sum(p.cpu_times().user + p.cpu_times().system for p in [here, *here.children(recursive=True)])


def test_many_cases_of_a_layout(tmp_path):
    """Cases of an optimised layout, 30 of 360 members: in one call over two threads, and as rows of two
    worker processes, which is the way of models without `responses_of_cases`."""
    study = load_study(str(files("studies") / "occupant_demo.toml"))
    model, options = restraint(steps=COARSE), {"steps": COARSE}
    rng = np.random.default_rng(0)
    density = np.zeros(model.members)
    density[rng.choice(180, 15, replace=False)] = density[180 + rng.choice(180, 15, replace=False)] = 0.4
    rows = study.space.rows(rng.random((400, study.space.dimension)))
    model.responses_of_cases(density, rows[:4])

    def timed(name, **limits):
        spec = ModelSpec(
            kind="layout", folder=".", names=study.space.names, responses={model.response: None},
            identity="bench", version="1", options={
                "layouts": str(tmp_path / name / "layouts"), "model": "studies.occupant_braking:restraint",
                "options": options,
            },
        )  # fmt: skip
        with LayoutRuns(
            tmp_path / name, spec=spec, space=study.space, model=model, seed=0, workers=2, **limits
        ) as runs:
            evaluate = runs.of(density)
            evaluate(rows[:4], purpose="warm")
            begin = processor_time()
            found = [o.outputs[model.response] for o in evaluate(rows, purpose="bench")]
            return found, processor_time() - begin

    apart, before = timed("processes", timeout=600.0)
    together, after = timed("threads")
    assert together == apart
    print(f"\n  4 000 cases of a layout, in one call over threads: {10 * after:.0f} CPU s")
    print(f"  4 000 cases of a layout, as rows of processes: {10 * before:.0f} CPU s")

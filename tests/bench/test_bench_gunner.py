"""What the gunner on his vehicle costs: a second at L0 and 1 ms, its gradient by 360 members, his cabin, the
64 runs of a screening. Beside Pinocchio's derivatives of the inverse dynamics of the same tree.
"""

import resource
import shutil
import subprocess
import sys
import time
from importlib.resources import files

import numpy as np
import pytest

from studies.gunner.cases import Case, system
from studies.gunner.checks.contacts import GROUNDS, STEP
from studies.gunner.occupant_responses import objectives
from studies.gunner.restraints.model import restraint
from studies.gunner.uncertain import NOMINAL
from tests.peers.engine.tree.test_pinocchio import peer_model
from workbench.engine import gradient, simulate

pytestmark = pytest.mark.bench

T_END, STEPS = 1.0, 1000


def cpu(call, count=1):
    begin = time.process_time()
    for _ in range(count):
        found = call()
    return (time.process_time() - begin) / count, found


@pytest.mark.parametrize("on", ["braking", "step steer"])
def test_a_second_of_the_gunner_beside_pinocchio(on):
    pin = pytest.importorskip("pinocchio")
    model = restraint(on=on, t_end=T_END)
    bare, held, density = system(Case()), model.system(NOMINAL), np.full(model.members, 0.03)
    assert model.members == 360
    peer, _ = peer_model(pin, bare)
    data, q, v = peer.createData(), pin.neutral(peer), np.random.default_rng(1).normal(size=peer.nv)
    objective = objectives(held, t_end=T_END)["g1"]

    def forward(of, alpha):
        return simulate(of, alpha, T_END, STEPS)

    gradient(held, density, forward(held, density), objective)
    rows = []
    for _ in range(3):
        beside, _ = cpu(lambda: pin.computeRNEADerivatives(peer, data, q, v, v), 300)
        alone, _ = cpu(lambda: forward(bare, np.zeros(0)))
        whole, run = cpu(lambda: forward(held, density))
        back, _ = cpu(lambda run=run: gradient(held, density, run, objective))
        rows.append((alone, whole, whole + back, alone / beside / STEPS, (whole + back) / beside / STEPS))
    alone, whole, both, one, two = np.median(rows, axis=0)
    print(f"\n  {on}: a second without members {alone:.3f} s, with 360 {whole:.3f} s   (goal 0.4)")
    print(f"  {on}: with the gradient of 360 members {both:.3f} s   (goal 0.7)")
    print(f"  {on}: a step is {one:.1f} of Pinocchio's derivatives, with gradient {two:.1f}")


def test_a_second_in_the_cabin():
    """Level L1, steps of 0.5 ms: 352 contacts beside everything else."""
    case = Case(level="L1", on=GROUNDS["braking"])
    made = system(case)
    simulate(made, np.zeros(0), 0.01, 20)
    spent, run = cpu(lambda: simulate(made, np.zeros(0), 1.0, round(1.0 / STEP)))
    assert np.isfinite(run.position).all()
    print(f"\n  a second at level L1, {STEP:g} s a step: {spent:.2f} s of processor time")


def test_the_64_runs_of_a_screening(tmp_path):
    """Joints in a step steer of 1 s, two workers, from the study's file to the screening; kernels cached."""
    study = shutil.copy(str(files("studies.gunner") / "joint_stiffness.toml"), tmp_path)
    begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-m", "workbench", "run", study], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"\n  64 runs and their screening: {time.perf_counter() - begin:.0f} s, of a processor {spent:.0f} s"
    )
    print("  (goal 30 s with two workers on two free cores)")

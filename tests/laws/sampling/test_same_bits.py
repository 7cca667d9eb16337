"""Designs that grow, and parts of designs, are the same bits whatever instructions the processor offers."""

import os
import subprocess
import sys

import pytest

from tests.laws.doe.test_same_bits import PLAIN

DESIGNS = """
import hashlib
import numpy as np
from workbench.sampling.parts import first_part
from workbench.sampling.plan import make_design
from workbench.space.box import Space
from workbench.space.parameter import Parameter

def space(d):
    return Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(d)])

designs = {
    f"{d} inputs, {n} to {m}": make_design(space(d), runs=n, seed=SEED).grown(m - n, seed=SEED)
    for d, n, m in ((3, 20, 30), (15, 40, 60))
}
designs["a part"], later = first_part(make_design(space(6), runs=30, seed=SEED), 20)
for name, design in designs.items():
    print(name, hashlib.sha256(np.ascontiguousarray(design.unit).tobytes()).hexdigest()[:16])
"""


def bits(seed, cache, **env):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", DESIGNS.replace("SEED", str(seed))],
        env=os.environ | env | {"NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


@pytest.mark.slow
def test_the_same_bits_on_a_plain_processor(tmp_path):
    for seed in (3, 4):
        ours = bits(seed, tmp_path / "native")
        assert len(ours) == 3
        assert ours == bits(seed, tmp_path / "plain", **PLAIN)

"""Every sampler gives the same bits whatever instructions and linear algebra kernels the processor offers."""

import os
import subprocess
import sys

import pytest

DESIGNS = """
import hashlib
import numpy as np
import doe

def rng():
    return np.random.default_rng(SEED)

corners = np.array(np.meshgrid(*[[0.0, 0.5, 1.0]] * 4)).reshape(4, -1).T
levels = doe.coordinate_exchange(20, 4, levels=[2, 3, 5, 7], rng=rng())
designs = {
    "lhs": doe.lhs(50, 20, rng=rng()),
    "ihs": doe.ihs(50, 20, rng=rng()),
    "ihs auto": doe.ihs(64, 8, target="auto", rng=rng()),
    "sobol": doe.sobol(64, 5, rng=rng()),
    "decorrelated": doe.decorrelated_lhs(2_000, 8, rng=rng()),
    "augment": doe.augment(doe.lhs(20, 4, rng=rng()), 20, rng=rng()),
    "sliced": doe.sliced_lhs(4, 10, 3, rng=rng()),
    "select": doe.d_optimal_select(64, 8, model="quadratic", rng=rng()),
    "select linear": doe.d_optimal_select(50, 20, pool=1000, rng=rng()),
    "select long": doe.d_optimal_select(40, 6, model="quadratic", pool=8000, rng=rng()),
    "within": doe.d_optimal_within(50, 8, rng=rng()),
    "best of": doe.d_optimal_best_of(12, 2, tries=200, rng=rng()),
    "grid D": doe.exchange(corners, 24, rng=rng()),
    "grid I": doe.exchange(corners, 24, criterion="I", rng=rng()),
    "levels": levels,
}
for name in ("phi_p", "cd2", "maxpro", "correlation"):
    designs[name] = doe.optimised_lhs(50, 8, criterion=name, swaps=20_000, rng=rng())
for name, points in designs.items():
    print(name, hashlib.sha256(np.ascontiguousarray(points).tobytes()).hexdigest()[:16])
"""
PLAIN = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512F AVX512CD AVX2 FMA3",
}


def run(seed, cache, **env):
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
def test_the_same_bits_on_a_plain_processor_and_with_two_threads(tmp_path):
    native = tmp_path / "native"
    for seed in (3, 4):
        ours = run(seed, native, OPENBLAS_NUM_THREADS="1")
        assert len(ours) == 19
        assert ours == run(seed, native, OPENBLAS_NUM_THREADS="2", NUMBA_NUM_THREADS="2")
        assert ours == run(seed, tmp_path / "plain", **PLAIN)

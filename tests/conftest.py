"""Shared set-up: one BLAS thread and the same examples of every law, so that a run repeats.

One BLAS thread, since timings and rounding would depend on the machine's load. `make laws` draws
others each time it is called.
"""

import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as where a shell runs us in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("explore", derandomize=False)
settings.load_profile("repeatable")

LONG = Path(__file__).parent / "long.txt"
PATIENCE = 900  # s for a slow test that says nothing else: three times what the busiest machine has taken


def pytest_collection_modifyitems(config, items):
    """Mark what `make fast` leaves out: the tests that `tests/long.txt` lists, by file and function.

    Slow tests get time: on a busy machine they take several times what they take alone.
    """
    long = set(LONG.read_text().split())
    root = config.rootpath
    for item in items:
        function = getattr(item, "originalname", item.name)
        if f"{item.path.relative_to(root).as_posix()}::{function}" in long:
            item.add_marker("long")
        if item.get_closest_marker("slow") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(PATIENCE))

"""Simulations side by side: runs and adjoint sweeps share nothing, and the kernels free the lock.

What is computed does not depend on the number of threads: every case has buffers of its own, and results keep
the order of the cases.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["side_by_side"]

Item = TypeVar("Item")
Found = TypeVar("Found")


def side_by_side(work: Callable[[Item], Found], items: Sequence[Item], *, threads: int = 0) -> list[Found]:
    """[work(item) for item in items] in up to `threads` threads, by default one per usable processor."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    count = min(threads or usable, len(items))
    if count < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(work, items))

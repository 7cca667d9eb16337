"""From a design to a test plan: blocks, replicates, the order of the runs."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe import _kernels_blocks as kernels
from doe.criteria.regression import Model, model_matrix
from doe.criteria.spread import unit_points
from doe.portable.draws import shuffled, splitmix

__all__ = ["blocks", "replicates", "run_order"]

Integers = NDArray[np.int64]
WHOLE = 2**20


def blocks(
    points: ArrayLike, count: int, *, model: Model = "linear", trials: int = 50_000, rng: np.random.Generator
) -> Integers:
    """A block number 0..count-1 for each run, (n,): block sizes differ by one at most.

    Runs are swapped between blocks until the model's columns have nearly the same mean in every block, so
    that block effects disturb the estimates least (orthogonal blocking when all means are equal).

    >>> points = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
    >>> label = blocks(points, 2, rng=np.random.default_rng(1))
    >>> bool(label[0] == label[3] != label[1] == label[2])
    True

    Raises: ValueError unless 1 <= count <= n.
    """
    array = unit_points(points)
    n = len(array)
    if not 1 <= count <= n:
        raise ValueError(f"count needs 1..{n} blocks for {n} runs, got {count}")
    if trials < 0:
        raise ValueError(f"trials needs a whole number >= 0, got {trials}")
    draws = splitmix(rng)
    label = shuffled(np.arange(n) % count, draws)
    x = model_matrix(array, model=model)
    columns = np.rint((x - x.mean(axis=0)) * WHOLE) / WHOLE
    sums = np.stack([columns[label == b].sum(axis=0) for b in range(count)])
    sizes = np.bincount(label, minlength=count).astype(float)
    if count > 1:
        kernels.deal(np.ascontiguousarray(columns), label, sums, sizes, trials, draws)
    return label


def replicates(n: int, times: int) -> Integers:
    """Row numbers of n runs done `times` times, (n times,): all runs once, then all again.

    >>> replicates(3, 2).tolist()
    [0, 1, 2, 0, 1, 2]

    Raises: ValueError for n or times < 1.
    """
    if n < 1 or times < 1:
        raise ValueError(f"n and times need whole numbers >= 1, got n={n} and times={times}")
    return np.tile(np.arange(n, dtype=np.int64), times)


def run_order(n: int, *, block: ArrayLike | None = None, rng: np.random.Generator) -> Integers:
    """Row numbers in the order to run them, (n,): random, blocks one after the other when given.

    >>> order = run_order(6, block=[1, 0, 1, 0, 1, 0], rng=np.random.default_rng(1))
    >>> sorted(order[:3].tolist()), sorted(order[3:].tolist())
    ([1, 3, 5], [0, 2, 4])

    Raises: ValueError for n < 1 or a block list of another length.
    """
    if n < 1:
        raise ValueError(f"n needs a whole number >= 1, got {n}")
    order = shuffled(np.arange(n), splitmix(rng))
    if block is None:
        return order
    label = np.asarray(block)
    if label.shape != (n,):
        raise ValueError(f"block needs one number per run, shape ({n},), got {label.shape}")
    return np.asarray(order[np.argsort(label[order], kind="stable")])

"""Records of arrays in kernels, and the kernels' own compiler."""

import gc
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from workbench.engine.compiler.options import ENTRY, INNER
from workbench.engine.compiler.records import passed_as_record


@passed_as_record
class Some(NamedTuple):
    """Arrays of several ranks and types."""

    one: np.ndarray
    two: np.ndarray
    three: np.ndarray
    whole: np.ndarray


@njit(**INNER)
def inner(S, shift):
    total = 0.0 * S.one[0]
    for i in range(S.two.shape[0]):
        row = S.two[i]
        for j in range(row.shape[0]):
            total += row[j] * S.three[i, j, S.whole[0]]
    S.one[0] = total + shift
    return S.three.size + S.two.shape[1]


@njit(**{**ENTRY, "cache": False})
def outer(S, shift):
    return inner(S, shift) + 0 * inner(S, shift)


def some(dtype=float, order="C"):
    two = np.arange(6.0).reshape(2, 3).astype(dtype)
    three = np.asarray(np.arange(24.0).reshape(2, 3, 4), dtype, order=order)
    return Some(np.zeros(1, dtype), two, three, np.array([2]))


def expected(S):
    return (S.two * S.three[:, :, 2]).sum()


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_record_reads_and_writes_its_arrays(order):
    S = some(order=order)
    assert outer(S, 0.5) == 24 + 3
    assert S.one[0] == expected(S) + 0.5
    other = S._replace(two=2.0 * S.two)  # the same type, other arrays
    outer(other, 0.0)
    assert S.one[0] == other.one[0] == expected(other)


def test_types_of_the_arrays_tell_records_apart():
    S = some(complex)
    outer(S, 1j)
    assert S.one[0] == expected(S) + 1j
    with pytest.raises(TypingError, match="pyobject"):
        outer(S._replace(one=None), 0.0)


def test_the_collector_is_left_as_it_was():
    @njit(**{**ENTRY, "cache": False})
    def kernel(S):
        return S.whole[0] + 1

    for running in (False, True):
        (gc.enable if running else gc.disable)()
        try:
            assert kernel(some(float if running else complex)) == 3
            assert gc.isenabled() is running
        finally:
            gc.enable()


def test_what_was_compiled_counts_as_old_and_what_is_frozen_stays_frozen():
    @njit(**{**ENTRY, "cache": False})
    def kernel(S):
        return S.whole[0] + 2

    kernel(some())
    assert gc.get_freeze_count() == 0
    gc.freeze()
    try:
        frozen = gc.get_freeze_count()
        kernel(some(complex))
        assert 0.5 * frozen < gc.get_freeze_count() <= frozen
    finally:
        gc.unfreeze()


def test_a_fault_in_a_kernel_is_told_and_leaves_the_collector_running():
    @njit(**{**ENTRY, "cache": False})
    def kernel(S):
        return S.missing[0]

    with pytest.raises(TypingError, match="missing"):
        kernel(some())
    assert gc.isenabled()

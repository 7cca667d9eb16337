"""How kernels are put together from functions: each linked once, also by callers that numba compiles."""

import pytest
from numba import njit

from workbench.engine.compiler.options import CALLED, ENTRY, INNER

UNCACHED = {**ENTRY, "cache": False}


@njit(**INNER)
def deepest(x):
    return x + 1.0


@njit(**INNER)
def deeper(x):
    return max(deepest(x), deepest(2.0 * x))


@njit(**CALLED)
def apart(x):
    return deeper(x) * deepest(x)


@njit(**UNCACHED)
def ours(x):
    return apart(x) + deeper(x) + apart(-x)


@njit
def numbas(x):
    return apart(x) + deeper(x) + apart(-x)


@njit(**UNCACHED)
def second(x):
    return ours(x) + deeper(x)


@njit(**INNER)
def late(x):
    return 3.0 * x


@njit(**INNER)
def never(x):
    return late(x) if 1 > 2 else x  # LLVM takes the call away before anything is linked


@njit(**INNER)
def always(x):
    return late(x) + 1.0


@njit(**UNCACHED)
def both(x):
    return never(x) + always(x)


def test_a_function_that_its_first_caller_does_not_call_is_linked():
    assert both(2.0) == 9.0


@pytest.mark.parametrize("call", [ours, numbas])
def test_functions_several_calls_deep_are_found(call):
    def plain(x):
        return max(x + 1.0, 2.0 * x + 1.0)

    for x in (-2.0, 0.5):
        assert call(x) == plain(x) * (x + 1.0) + plain(x) + plain(-x) * (1.0 - x)


def test_kernels_call_kernels():
    assert second(0.5) == ours(0.5) + 2.0


def test_a_function_that_is_called_stays_one():
    """Inner ones go into their callers; one that stands under `CALLED` is written once."""
    ours(1.0)
    (text,) = ours.inspect_llvm().values()
    defined = [line for line in text.splitlines() if line.startswith("define")]
    assert sum("apart" in line for line in defined) == 1
    assert not any("deeper" in line or "deepest" in line for line in defined)
    assert sum("apart" in line and " call " in line for line in text.splitlines()) == 2

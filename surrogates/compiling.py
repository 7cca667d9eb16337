"""All kernels compiled at once, rather than each where it is first needed."""

import numpy as np

from .kriging.estimator import Kriging
from .screening.screener import KrigingScreener

__all__ = ["are_kernels_compiled", "compile_kernels"]

RUNS, INPUTS = 16, 4


def are_kernels_compiled() -> bool:
    """Whether the machine code of the kernels is kept on disk by now, or there is no place to keep it."""
    from ._kernel_cache import is_kept
    from .likelihood._kernels_correlation import derivatives
    from .likelihood._kernels_likelihood import ascend

    return is_kept(ascend) and is_kept(derivatives)


def compile_kernels() -> None:
    """Compile what a screening and a Kriging need: some fifteen seconds, once an installation.

    numba compiles a kernel for the types that it is called with, so this screens a small table: one that no
    smooth correlation explains, which has its rivals tried as well.
    """
    x = np.random.default_rng(0).random((RUNS, INPUTS))
    y = x[:, 0] + 0.3 * np.cos(40 * x[:, 1])
    KrigingScreener(n_starts=2, enough=1).fit(x, y)
    kriging = Kriging(correlation="matern52", trend="constant", n_starts=1, intervals="plug-in").fit(x, y)
    kriging.leave_one_out()
    kriging.predict(x[:2], return_std=True)

# mypy: ignore-errors
"""Forces of members of one law over a history of elongations, compiled once for all kinds of systems."""

from numba import njit

from ..compiler.options import ENTRY
from ._kernels_laws import energies, laws


@njit(**ENTRY)
def law_series(code, p, delta, rate, times, f, fd, fv, energy):
    """Fill f, df/ddelta, df/drate and the stored energy (nodes, members) at unit density.

    p: (PARAMETERS, members)
    """
    for node in range(delta.shape[0]):
        members = delta.shape[1]
        laws(code, p, 0, members, delta[node], rate[node], times[node], f[node], fd[node], fv[node])
        energies(code, p, 0, members, delta[node], times[node], energy[node])

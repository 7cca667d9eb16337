# mypy: ignore-errors
"""The laws of the members as one kernel each for force, energy and parameter slopes, compiled.

delta is the elongation (length minus natural length), rate its time derivative; f > 0 is tension. A law is
one code and one column of the parameter table p (law rows x members). A law stands in its own file alone;
laws written in Python are left out.
"""

from importlib import import_module

from numba import njit

from ..compiler.options import INNER
from ._kernels_by_code import by_code, by_held_code
from .table import LAWS, USER, code_of

__all__ = [
    "USER", "elastic", "energies", "held_energies", "held_laws", "held_parameter_slopes", "law_parameters",
    "laws",
]  # fmt: skip

_FILES = {name: import_module(f"{__package__}.{file}") for name, file in LAWS.items()}


_FORCES = "p, first, last, delta, rate, t, f, fd, fv"
_ENERGIES = "p, first, last, delta, t, energy"
_SLOPES = "p, i, delta, rate, t, dp"

# fill f, df/ddelta, df/drate of members first..last-1 at unit density
laws = by_code(_FILES, "forces", _FORCES)
# fill the energy of members first..last-1 at unit density
energies = by_code(_FILES, "energies", _ENERGIES)
_parameter_slopes = by_code(_FILES, "parameter_slopes", _SLOPES)
# the same of the laws that a system holds, told by the type of the first argument
held_laws = by_held_code(_FILES, "forces", _FORCES)
held_energies = by_held_code(_FILES, "energies", _ENERGIES)
held_parameter_slopes = by_held_code(_FILES, "parameter_slopes", _SLOPES)
_INELASTIC = tuple(code_of(name) for name, file in _FILES.items() if not getattr(file, name).elastic)


@njit(**INNER)
def elastic(code):
    """Whether the force of a law without its damper is the slope of its energy."""
    for other in _INELASTIC:
        if code == other:
            return False
    return True


@njit(**INNER)
def law_parameters(code, p, i, delta, rate, t, dp):
    """Fill dp with the slopes of the unit force of member i with respect to its parameters."""
    for j in range(dp.shape[0]):
        dp[j] = 0.0
    _parameter_slopes(code, p, i, delta, rate, t, dp)

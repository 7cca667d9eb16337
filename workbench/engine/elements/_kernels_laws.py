# mypy: ignore-errors
"""The laws of the members as one kernel each for force, energy and parameter slopes, compiled.

delta is the elongation (length minus natural length), rate its time derivative; f > 0 is tension. A law is
one code and one column of the parameter table p (law rows x members). The choices by code are written out of
the table `LAWS`, one `if` a law, so that a law stands in its own file alone.
"""

from importlib import import_module

from numba import njit

from ..compiler.options import INNER
from .table import LAWS, USER, code_of

__all__ = ["USER", "elastic", "energies", "law_parameters", "laws"]

_FILES = {name: import_module(f"{__package__}.{file}") for name, file in LAWS.items()}


def _by_code(kernel, arguments):
    """The kernel of that name of all laws: (code, *arguments); laws written in Python are left out."""
    lines = [f"def choose(code, {arguments}):"]
    for name, file in LAWS.items():
        lines += [f"    if code == {code_of(name)}:", f"        {file}({arguments})", "        return"]
    kernels = {file: getattr(_FILES[name], kernel) for name, file in LAWS.items()}
    exec("\n".join(lines), kernels)
    return njit(**INNER)(kernels["choose"])


# fill f, df/ddelta, df/drate of members first..last-1 at unit density
laws = _by_code("forces", "p, first, last, delta, rate, t, f, fd, fv")
# fill the energy of members first..last-1 at unit density
energies = _by_code("energies", "p, first, last, delta, t, energy")
_parameter_slopes = _by_code("parameter_slopes", "p, i, delta, rate, t, dp")
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

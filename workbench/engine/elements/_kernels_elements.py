# mypy: ignore-errors
"""The force elements between bodies as one kernel each for forces, energy and parameter slopes, compiled."""

from importlib import import_module

from ._kernels_by_code import by_code
from .table import ELEMENTS

__all__ = ["energy", "forces", "forces_with_state", "parameter_slopes"]

_FILES = {name: import_module(f"{__package__}.{file}") for name, file in ELEMENTS.items()}


# add F, K and C of an element to those of its pair of bodies
forces = by_code(
    {name: file for name, file in _FILES.items() if not getattr(file, name).states},
    "forces", "p, e, big, fr, kr, cr",
)  # fmt: skip
forces_with_state = by_code(
    {name: file for name, file in _FILES.items() if getattr(file, name).states},
    "forces", "p, e, big, z, rate, half, tangent, fr, kr, cr, slopes, out",
)  # fmt: skip
# add the energy of an element to out[0]
energy = by_code(
    {name: file for name, file in _FILES.items() if getattr(file, name).elastic}, "energy", "p, e, big, out"
)
# fill dp (., 3), rows as in `names`: slopes of F by the parameters
parameter_slopes = by_code(_FILES, "parameter_slopes", "p, e, big, z, dp")

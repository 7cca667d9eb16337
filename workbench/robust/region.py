"""The part of the design space that a cycle of a minimax search looks at."""

from dataclasses import dataclass

import numpy as np

__all__ = ["Region"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """The box of `width` around `centre` (dx,), in the unit cube of the design."""

    centre: np.ndarray
    width: float

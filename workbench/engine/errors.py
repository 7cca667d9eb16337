"""The exceptions of the engine, as a tree.

EngineError
├── InvalidSystem    a body, joint, member or load does not fit the system (also a ValueError)
├── AssemblyError    the start does not satisfy the joints; carries the correction (also a ValueError)
├── NotConverged     the integrator stopped before the end (also an ArithmeticError)
└── NotSupported     the chosen scheme or sensitivity cannot treat this system (also a ValueError)
"""

from typing import Any

import numpy as np

__all__ = ["AssemblyError", "EngineError", "InvalidSystem", "NotConverged", "NotSupported"]


class EngineError(Exception):
    """Base of every error that the engine raises on purpose."""


class InvalidSystem(EngineError, ValueError):
    """A body, joint, member or load does not fit the system."""


class AssemblyError(EngineError, ValueError):
    """The initial positions do not satisfy the joints.

    `position` (n,) is the nearest one that does, `size` how far it moves a coordinate (m or rad).
    """

    def __init__(self, message: str, position: "np.ndarray[Any, Any]", size: float) -> None:
        super().__init__(message)
        self.position = position
        self.size = size


class NotConverged(EngineError, ArithmeticError):
    """The integrator stopped before the end; `time` is where."""

    def __init__(self, message: str, time: float) -> None:
        super().__init__(message)
        self.time = time


class NotSupported(EngineError, ValueError):
    """The chosen scheme or sensitivity cannot treat this system."""

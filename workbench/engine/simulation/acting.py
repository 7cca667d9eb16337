"""A system without the members that do nothing: what many runs of one layout need.

An optimised layout has a few dozen members out of hundreds; the others have densities that no force can be
seen of. Run without them it costs what its bodies and the few cost.
"""

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .simulate import checked_density

__all__ = ["NEGLIGIBLE", "acting_members"]

Kind = TypeVar("Kind", bound=Any)  # of system

NEGLIGIBLE = 1e-6  # of a full member


def acting_members(
    system: Kind, density: ArrayLike, *, negligible: float = NEGLIGIBLE
) -> tuple[Kind, NDArray[np.float64]]:
    """The system with the members of more than `negligible` density, and their densities.

    Joints, springs, bushings, loads and the order of the members stay. What is left out has less than
    `negligible` times the force of a full member each. For runs alone: a gradient needs every candidate.

    Args:
        system: any system of the engine whose `members` have a density each.
        density: (members,), each at least 0.

    Raises:
        ValueError: the densities are not one finite number >= 0 for each member.

    >>> from workbench.engine import Body, Member, Motion, Spring, System
    >>> ball, wall = Body(name="ball"), Body(name="wall", motion=Motion(position=lambda t: (0.0, 0.0, 0.0)))
    >>> members = [Member(a="ball", b="wall", point_b=(x, 1.0), law=Spring(k=100.0)) for x in (0.0, 1.0)]
    >>> few, left = acting_members(System(bodies=(ball, wall), members=tuple(members)), [1.0, 1e-9])
    >>> len(few.members), left.tolist()
    (1, [1.0])
    """
    density = checked_density(system, np.asarray(density))
    acts = density > negligible
    few = tuple(member for member, does in zip(system.members, acts, strict=True) if does)
    return replace(system, members=few), density[acts]

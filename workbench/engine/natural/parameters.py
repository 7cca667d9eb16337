"""Slopes of a run in natural coordinates by any number: lengths, masses, points, laws, the start.

Conditions are set up from the points at the start, so a point's place reaches the lengths and angles that are
kept, the mass of its element and the natural lengths of members; all of them are read off the tables of the
systems that a parameter makes.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..integration.changes import Multipliers, lagrangian_of, slopes_by_change
from ..integration.kinds import Change
from ..integration.seeds import Seeds
from .compiled import Compiled, compiled, on_grid
from .start import checked, independent_equations
from .system import NaturalSystem

__all__ = ["slopes_by_changes"]

Array = np.ndarray[Any, Any]


def slopes_by_changes(
    trajectory: Any,
    value: Callable[[Any], float],
    seeds: Seeds,
    changes: Sequence[Change],
    found: Multipliers,
) -> Array:
    """(changes,) slopes of value(trajectory), a `NaturalTrajectory`, whose seeds are given.

    found: what its backward sweep told. Raises ValueError for systems of another structure, AssemblyError for
    starts that do not meet the conditions.
    """
    r = trajectory

    def begin(system: NaturalSystem) -> tuple[Array, Array]:
        if r.start is not None:  # the run goes on from a start that is held
            return r.position[0].copy(), r.velocity[0].copy()
        parts = compiled(system)
        _same(parts, compiled(r.system))
        q, v, _ = checked(parts, on_grid(parts, r.density, np.zeros(1)))
        return q, v

    def total(system: NaturalSystem) -> float:
        parts = compiled(system)
        _same(parts, compiled(r.system))
        equations = independent_equations(parts, on_grid(parts, r.density, found.times))
        return lagrangian_of(equations, found, begin(system))

    def held(system: NaturalSystem) -> float:
        """The objective on the states that ran, the first of them at that system's start."""
        position, velocity = r.position.copy(), r.velocity.copy()
        position[0], velocity[0] = begin(system)
        tables = on_grid(compiled(system), r.density, r.times)
        return value(replace(r, system=system, tables=tables, position=position, velocity=velocity))

    return slopes_by_change(found, seeds, changes, start=begin, total=total, held=held)


def _same(parts: Compiled, ran: Compiled) -> None:
    """Raise ValueError unless a system has the points, conditions and members of the one that ran."""
    mine, theirs = (
        [
            list(p.index.items()),
            *(p.arrays[name].tolist() for name in ("product", "linear", "ends", "segment")),
        ]
        for p in (parts, ran)
    )
    if mine != theirs:
        raise ValueError(
            "parameter_slopes needs systems of the same points, conditions and members at every value of a "
            "parameter, got one of another structure"
        )

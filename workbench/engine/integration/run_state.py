"""Where a run stands at a node: all that the next step of its scheme looks at, so that another run goes on.

Predictors look at a few nodes before, generalised-alpha at its auxiliary acceleration, Newton's method at the
factors and scales that it has: with all of them two parts of a run are the whole, to the bit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from .grids import one_step_length
from .schemes import Scheme

__all__ = ["Course", "GoesOn", "RunState", "checked_start", "earlier_nodes", "earlier_times", "state_at"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunState:
    """A run at one node, as `simulate(..., start=)` takes it.

    time: s.  step: length of the step that led there, s.  scheme: of the run.
    position, velocity, acceleration, multiplier: of the node, as in its trajectory.
    states, state_rates: of first order.
    auxiliary: (n,) the acceleration a of generalised-alpha, empty of other schemes; of trees the states and
    multipliers have theirs behind it.
    earlier: the last nodes as the predictor looks at them, oldest first, this one last; by array.
    solver: what Newton's method and the split of coordinates carry, arrays of the kind of system.
    """

    time: float
    step: float
    scheme: Scheme
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    states: Array
    state_rates: Array
    auxiliary: Array
    earlier: Mapping[str, Array]
    solver: tuple[Array, ...]

    @property
    def known(self) -> int:
        """Nodes in `earlier`."""
        return len(self.earlier["times"])

    def sizes(self) -> tuple[int, ...]:
        """Lengths of places, velocities, multipliers and states."""
        return len(self.position), len(self.velocity), len(self.multiplier), len(self.states)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """Where a run began, None for the system's own start, and the same run up to an earlier node again."""

    start: RunState | None
    until: Callable[[Array], Any]


class GoesOn:
    """What trajectories share that another run can go on from; they have `times`, `course` and `last`."""

    __slots__ = ()

    @property
    def start(self) -> RunState | None:
        """Where the run went on from, None for the system's own start."""
        course: Course | None = self.course  # type: ignore[attr-defined]
        return None if course is None else course.start

    @property
    def step(self) -> float:
        """Length of a step, s. Raises NotSupported where steps are unequal."""
        before = None if self.start is None else self.start.step
        return one_step_length(self.times, "what asks for the step", before)  # type: ignore[attr-defined]

    def state(self, node: int = -1) -> RunState:
        """Where the run stands at a node, as `simulate(..., start=)` takes it.

        At an earlier node than the last the run is made again up to there.
        Raises ValueError for nodes that the run does not have.
        """
        return state_at(self, node)


def checked_start(start: RunState | None, scheme: Scheme, sizes: tuple[int, ...]) -> None:
    """ValueError unless a start is of this scheme and of a system with these `sizes`, as in `RunState`."""
    if start is None:
        return
    if start.scheme != scheme:
        raise ValueError(f"start comes from a run of {start.scheme}; go on with that scheme, got {scheme}")
    if start.sizes() != sizes:
        raise ValueError(
            "start needs the places, velocities, multipliers and states of the system, "
            f"{sizes} of them, got {start.sizes()}: it comes from a run of another system"
        )


def earlier_nodes(start: RunState | None, count: int, **arrays: Array) -> dict[str, Array]:
    """The last nodes of a run, at most `count`, as copies; what an even earlier run knew stands before them.

    arrays: (nodes, ...) by name, the first node of them that of `start`, where there is one.
    """
    if start is not None:
        arrays = {name: np.concatenate([start.earlier[name][:-1], x]) for name, x in arrays.items()}
    return {name: np.array(x[-count:]) for name, x in arrays.items()}


def earlier_times(start: RunState | None, times: Array) -> Array:
    """The times of a run, those of the nodes before its start in front."""
    return times if start is None else np.concatenate([start.earlier["times"][:-1], times])


def state_at(run: Any, node: int) -> RunState:
    """`RunState` of a trajectory at a node. ValueError for a node that it does not have."""
    nodes = len(run.times)
    at = node + nodes if node < 0 else node
    if not 0 <= at < nodes:
        raise ValueError(f"node needs to be one of the run's {nodes}, got {node}")
    if run.course is None or run.last is None:
        raise NotSupported("this run was put together from others and holds no state to go on from")
    if at == nodes - 1:
        return run.last(run)  # type: ignore[no-any-return]
    if at == 0:
        if run.course.start is None:
            raise ValueError("node 0 is the start of the system itself: run without start=")
        return run.course.start  # type: ignore[no-any-return]
    again = run.course.until(run.times[: at + 1].copy())
    return again.last(again)  # type: ignore[no-any-return]

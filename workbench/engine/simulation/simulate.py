"""simulate: integrate a system of any kind over time and return its trajectory."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast, overload

import numpy as np

from ..errors import NotSupported
from ..integration.grids import checked_times
from ..integration.kinds import AnySystem, AnyTrajectory
from ..integration.run_state import RunState
from ..integration.schemes import GeneralisedAlpha, RungeKutta8, Scheme
from ..natural import runs as natural
from ..natural.runs import NaturalTrajectory
from ..natural.system import NaturalSystem
from ..planar import runs as planar
from ..planar.system import System
from ..planar.trajectory import Trajectory
from ..tree import runs as tree
from ..tree.system import TreeSystem
from ..tree.trajectory import TreeTrajectory
from .error_control import error_controlled

__all__ = ["KINDS", "simulate"]

Array = np.ndarray[Any, Any]

# kind of system -> run(system, density (N,), times (steps + 1,), scheme); with start= where it goes on
KINDS: dict[type, Callable[..., AnyTrajectory]] = {
    System: planar.run,
    NaturalSystem: natural.run,
    TreeSystem: tree.run,
}

# the same from a start of its own, for the grids that a tolerance asks for
PARTS: dict[type, Callable[..., AnyTrajectory]] = {System: planar.run_from, TreeSystem: tree.run_from}


def checked_density(system: AnySystem, density: Array) -> Array:
    """(N,) densities as a fresh float array. ValueError for other shapes, negative or infinite ones."""
    alpha = np.array(density, dtype=float)
    count = len(system.members)
    if alpha.shape != (count,):
        raise ValueError(f"density needs one value per member, shape ({count},), got shape {alpha.shape}")
    if not np.isfinite(alpha).all() or (alpha < 0.0).any():
        bad = int(np.flatnonzero(~np.isfinite(alpha) | (alpha < 0.0))[0])
        raise ValueError(f"density needs finite values >= 0, got density[{bad}]={alpha[bad]}")
    return alpha


@overload
def simulate(
    system: System,
    density: Array,
    t_end: float | None = None,
    steps: int | None = None,
    *,
    scheme: Scheme | None = None,
    times: Any = None,
    tolerance: float | None = None,
    most: int = 100_000,
    start: RunState | None = None,
) -> Trajectory: ...


@overload
def simulate(
    system: NaturalSystem,
    density: Array,
    t_end: float | None = None,
    steps: int | None = None,
    *,
    scheme: Scheme | None = None,
    times: Any = None,
    tolerance: float | None = None,
    most: int = 100_000,
    start: RunState | None = None,
) -> NaturalTrajectory: ...


@overload
def simulate(
    system: TreeSystem,
    density: Array,
    t_end: float | None = None,
    steps: int | None = None,
    *,
    scheme: Scheme | None = None,
    times: Any = None,
    tolerance: float | None = None,
    most: int = 100_000,
    start: RunState | None = None,
) -> TreeTrajectory: ...


@overload
def simulate(
    system: AnySystem,
    density: Array,
    t_end: float | None = None,
    steps: int | None = None,
    *,
    scheme: Scheme | None = None,
    times: Any = None,
    tolerance: float | None = None,
    most: int = 100_000,
    start: RunState | None = None,
) -> AnyTrajectory: ...


def simulate(
    system: AnySystem,
    density: Array,
    t_end: float | None = None,
    steps: int | None = None,
    *,
    scheme: Scheme | None = None,
    times: Any = None,
    tolerance: float | None = None,
    most: int = 100_000,
    start: RunState | None = None,
) -> AnyTrajectory:
    """Integrate the system from t = 0 or a start to t_end: in equal steps, over a grid, or to a tolerance.

        M q'' + F(q, q', t, alpha) + Phi_q^T lambda = 0,   Phi(q, t) = 0      (2.8), (2.27)

    Args:    density: (N,) alpha, one per member, >= 0    t_end: s, 0.2 unless given
             steps: number of steps, 200 unless given    scheme: GeneralisedAlpha(rho=0.8) unless given
             times: nodes, s, from 0 on, in place of t_end and steps; their distances may differ
             tolerance: of all places at all nodes, m or rad. Steps are then as long as they may be, none
             longer than t_end/steps (50 unless given); at most `most`. `times` of the run are those taken,
             its gradients theirs, and `diagnosis.notices` says how large the error was measured.
             start: `state()` of an earlier run, which goes on from that time: `times` begin there, and t_end
             is no length. Gradients hold the start fixed.
    Returns: a `Trajectory`, of a `NaturalSystem` a `NaturalTrajectory`, of a `TreeSystem` a `TreeTrajectory`.
    Raises ValueError for unusable arguments, AssemblyError when the start violates the joints, NotConverged
    when a step cannot be solved, NotSupported when the scheme cannot treat the system.

    >>> from workbench.engine import Body, Member, Spring, System, simulate
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))
    >>> run = simulate(System(bodies=(mass,), members=(spring,)), [1.0], t_end=1.0, steps=200)
    >>> float(round(run.position[-1, 0], 4))        # v0 sqrt(m/k) sin(sqrt(k/m))
    -0.0033
    """
    run = next((run for kind, run in KINDS.items() if isinstance(system, kind)), None)
    if run is None:
        kinds = ", ".join(kind.__name__ for kind in KINDS)
        raise TypeError(f"simulate needs a system of one of the kinds {kinds}, got {type(system).__name__}")
    if tolerance is not None and steps is None and times is None:
        steps = 50  # of the longest step
    grid = _grid(t_end, steps, times, 0.0 if start is None else start.time)
    alpha = checked_density(system, density)
    scheme = GeneralisedAlpha() if scheme is None else scheme
    if tolerance is None:
        return run(system, alpha, grid, scheme, **({} if start is None else {"start": start}))
    if start is not None:
        raise ValueError("simulate holds a tolerance from 0 s on; go on from a start with steps or times")
    if times is not None:
        raise ValueError("simulate needs either times or a tolerance, got both")
    if not 0.0 < tolerance < np.inf:
        raise ValueError(f"simulate needs tolerance > 0 m or rad, got tolerance={tolerance}")
    return _to_tolerance(system, alpha, grid, scheme, run, tolerance, most)


def _to_tolerance(
    system: AnySystem, alpha: Array, grid: Array, scheme: Scheme, run: Callable[..., AnyTrajectory],
    tolerance: float, most: int,
) -> AnyTrajectory:  # fmt: skip
    part = next((part for kind, part in PARTS.items() if isinstance(system, kind)), None)
    if part is None or not isinstance(scheme, GeneralisedAlpha | RungeKutta8):
        raise NotSupported(
            "a tolerance is held by GeneralisedAlpha and RungeKutta8, of planar systems and trees; got "
            f"{type(scheme).__name__} of a {type(system).__name__}"
        )
    finder = scheme if isinstance(scheme, GeneralisedAlpha) else GeneralisedAlpha()
    halves_none = replace(finder, halvings=0)  # the length of its steps is what is looked for
    found = error_controlled(
        lambda times, start: part(system, alpha, times, halves_none, start),
        lambda times: run(system, alpha, times, scheme),
        order=8 if isinstance(scheme, RungeKutta8) else 2,
        scheme=finder, t_end=float(grid[-1]), tolerance=tolerance, longest=float(grid[1]), most=most,
    )  # fmt: skip
    return cast(AnyTrajectory, found)


def _grid(t_end: float | None, steps: int | None, times: Any, begin: float) -> Array:
    """The nodes from `begin` on, from whichever way they were asked for."""
    if times is not None:
        if t_end is not None or steps is not None:
            raise ValueError("simulate needs either times, or t_end and steps, got both")
        return checked_times(times, begin=begin)
    t_end, steps = begin + 0.2 if t_end is None else t_end, 200 if steps is None else steps
    if not np.isfinite(t_end) or t_end <= begin:
        raise ValueError(f"simulate needs t_end > {begin:.9g} s, got t_end={t_end}")
    if int(steps) != steps or steps < 1:
        raise ValueError(f"simulate needs a whole number of steps >= 1, got steps={steps}")
    return np.linspace(begin, float(t_end), int(steps) + 1)

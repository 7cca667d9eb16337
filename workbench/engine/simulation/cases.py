"""Many cases of a system at once: other parameters, densities or loads, in threads."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from ..errors import NotConverged
from ..integration.kinds import AnySystem, AnyTrajectory
from ..integration.schemes import Scheme
from .side_by_side import side_by_side
from .simulate import simulate

__all__ = ["Case", "CaseResult", "simulate_cases"]

Array = np.ndarray[Any, Any]
Found = TypeVar("Found")

_COMPILED: set[tuple[type, type]] = set()  # kinds of systems and schemes that have run in this process


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run: a system of any kind and its densities (N,)."""

    system: AnySystem
    density: Array | Sequence[float]


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResult(Generic[Found]):
    """What was made of a run, or why it stopped: one of the two is None."""

    found: Found | None
    error: NotConverged | None


def simulate_cases(
    cases: Sequence[Case | Callable[[], Case]],
    then: Callable[[AnyTrajectory], Found],
    t_end: float = 0.2,
    steps: int = 200,
    *,
    scheme: Scheme | None = None,
    threads: int = 0,
) -> tuple[CaseResult[Found], ...]:
    """Simulate cases in threads and keep what `then` makes of each run, in the order of the cases.

    `then` takes a trajectory: `objective.value`, or a function that also takes a gradient. It is called in
    the run's thread, and the run is dropped behind it, so a thousand cases need the memory of as many runs
    as there are threads. Every number is that of a run alone, to the bit, whatever the number of threads: a
    run has arrays of its own. What has to be compiled is compiled by the first case of a kind of system and
    scheme alone; of functions that make cases the first one tells the kind.

    Args:    cases: systems of any kind, not necessarily of one, or functions that make one, called in the
             run's thread, so that a case is made while others run
             t_end: s    steps, scheme: as in `simulate`
             threads: 0 for one per usable processor; 1 runs them one after the other
    Raises what `simulate` and `then` raise, but NotConverged, which becomes the case's `error`.

    >>> from workbench.engine import Body, Coordinate, Member, Spring, System, Terminal
    >>> def case(k):
    ...     mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    ...     spring = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=k))
    ...     return Case(system=System(bodies=(mass,), members=(spring,)), density=[1.0])
    >>> end = Terminal(quantity=Coordinate(bodies=("mass",), direction=(1.0, 0.0)))
    >>> [round(x.found, 4) for x in simulate_cases([case(10.0), case(20.0)], end.value, t_end=1.0)]
    [-0.0033, -0.1086]
    """

    def result(case: Case | Callable[[], Case]) -> CaseResult[Found]:
        case = _made(case)
        try:
            run = simulate(case.system, np.asarray(case.density, float), t_end, steps, scheme=scheme)
            return CaseResult(found=then(run), error=None)
        except NotConverged as error:
            return CaseResult(found=None, error=error)

    ready = [*(_made(case) for case in cases[:1]), *cases[1:]]
    kinds = {(type(case.system), type(scheme)) for case in ready if isinstance(case, Case)}
    alone = 0 if kinds <= _COMPILED else 1
    first = [result(case) for case in ready[:alone]]
    _COMPILED.update((type(case.system), type(scheme)) for case in ready[:alone] if isinstance(case, Case))
    return (*first, *side_by_side(result, ready[alone:], threads=threads))


def _made(case: Case | Callable[[], Case]) -> Case:
    return case if isinstance(case, Case) else case()

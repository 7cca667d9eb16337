"""Numbers of member laws as design variables beside the densities: firing times, and whatever else a law has.

    x = (alpha_1 .. alpha_N, s_1 .. s_K),    p_k = lower_k + s_k (upper_k - lower_k),   0 <= s_k <= 1

A retractor fires at the t0 of (8.28), a bag at its `deploy`, a member in a window at its `start`. The
gradient is that of the computed run: mu^T dr/dp_k of the same backward sweep that gives dG/dalpha. A pulse or
a gate is smooth in time, so a time between two steps is as good as one on a step, as long as the steps
resolve it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...elements.airbag import Airbag
from ...elements.impulse import Impulse
from ...elements.laws import UserLaw
from ...elements.locking_retractor import LockingRetractor
from ...elements.timed import Timed
from ...elements.vented_airbag import VentedAirbag
from ...elements.webbing import Webbing
from ...integration.kinds import AnySystem, AnyTrajectory
from ...objectives.member_quantities import MemberForce
from ...objectives.quantities import StoredEnergy
from ...sensitivity.discrete_adjoint import parameter_gradient
from ...sensitivity.parameter_slopes import parameter_slopes
from .problem import InvalidLayout, LayoutProblem

__all__ = [
    "LawVariable", "check_variables", "extended_gradients", "values_at", "variables_held", "with_values",
]  # fmt: skip

Array = NDArray[np.float64]

_FIRES: Mapping[type, str] = {
    Impulse: "t0", Airbag: "deploy", VentedAirbag: "deploy", Timed: "start", Webbing: "fires",
    LockingRetractor: "locks",
}  # fmt: skip
_TIMES = ("t0", "deploy", "start", "end", "fires", "locks")
_RESOLVED = 2.0  # steps that a pulse's width or a gate's rise needs at least


@dataclass(frozen=True, slots=True, kw_only=True)
class LawVariable:
    """One number of the laws of some members, which all share it.

    name: for results.  members: their numbers.  lower, upper: bounds in `unit`.  start: None for the middle.
    parameter: a name of the law's parameters; None for the time at which it fires: `t0` of a pulse or
    retractor, `deploy` of an airbag, `start` of a member in a window, `fires` of webbing, `locks` of a reel.

    Raises InvalidLayout unless there are members and lower < upper, with start between.

    >>> LawVariable(name="squib", members=(3, 4), lower=0.05, upper=0.15).at(0.5)
    0.1
    """

    name: str
    members: tuple[int, ...]
    lower: float
    upper: float
    start: float | None = None
    parameter: str | None = None
    unit: str = "s"

    def __post_init__(self) -> None:
        if not self.members or not self.lower < self.upper:
            raise InvalidLayout(
                f"variable '{self.name}' needs members and lower < upper, got {len(self.members)} members, "
                f"lower={self.lower} and upper={self.upper}"
            )
        if self.start is not None and not self.lower <= self.start <= self.upper:
            raise InvalidLayout(f"variable '{self.name}' needs lower <= start <= upper, got {self.start}")

    def at(self, share: float) -> float:
        """The value at a share of the range."""
        return self.lower + float(share) * (self.upper - self.lower)

    @property
    def first(self) -> float:
        """The share of the range where the search starts."""
        return 0.5 if self.start is None else (self.start - self.lower) / (self.upper - self.lower)

    def of(self, law: Any) -> str:
        """The name of the parameter of a law."""
        return _FIRES.get(type(law), "") if self.parameter is None else self.parameter

    def moved(self, law: Any, value: float) -> Any:
        """The law with another value."""
        change = {self.of(law): float(value)}
        return law.changed(**change) if hasattr(law, "changed") else replace(law, **change)


def with_values(system: Any, variables: Sequence[LawVariable], values: Sequence[float]) -> Any:
    """The system with the values of all variables in its laws."""
    members = list(system.members)
    for variable, value in zip(variables, values, strict=True):
        for i in variable.members:
            members[i] = replace(members[i], law=variable.moved(members[i].law, value))
    return replace(system, members=tuple(members))


def values_at(problem: LayoutProblem, design: Array) -> dict[str, float]:
    """The values of a problem's law variables at a design, by name."""
    shares = np.asarray(design, dtype=float)[problem.densities :]
    return {variable.name: variable.at(s) for variable, s in zip(problem.variables, shares, strict=True)}


def variables_held(problem: LayoutProblem, design: Any) -> LayoutProblem:
    """The problem with its law variables fixed where a design has them, so that densities alone are left."""
    x, count = np.asarray(design, dtype=float), problem.densities
    lower, upper, start = problem.lower.copy(), problem.upper.copy(), problem.start.copy()
    lower[count:] = upper[count:] = start[count:] = x[count:]
    return replace(problem, lower=lower, upper=upper, start=start)


def check_variables(system: AnySystem, variables: Sequence[LawVariable], step: float) -> None:
    """Raise InvalidLayout for members or parameters that are not there, and for times that no step resolves.

    step: s, of the run.
    """
    names = [variable.name for variable in variables]
    if len(set(names)) < len(names):
        raise InvalidLayout(f"law variables need a name each, got {names}")
    taken: dict[tuple[int, str], str] = {}
    for variable in variables:
        for i in variable.members:
            if not 0 <= i < len(system.members):
                raise InvalidLayout(
                    f"variable '{variable.name}' needs members from 0 to {len(system.members) - 1}, got {i}"
                )
            _check(variable, i, system.members[i].law, step)
            other = taken.setdefault((i, variable.of(system.members[i].law)), variable.name)
            if other != variable.name:
                raise InvalidLayout(f"variables '{other}' and '{variable.name}' both set members[{i}]")


def _check(variable: LawVariable, i: int, law: Any, step: float) -> None:
    where, name = f"variable '{variable.name}' of members[{i}]", variable.of(law)
    if isinstance(law, UserLaw):
        raise InvalidLayout(f"{where} needs a law of the engine's own, got a UserLaw")
    if name not in law.names or not name:
        known = [known for known in law.names if known]
        raise InvalidLayout(
            f"{where} needs a parameter of its {type(law).__name__}, one of {', '.join(known)}, got "
            f"{variable.parameter!r}"
        )
    row = law.names.index(name)
    ends = [
        np.array(_moved(variable, law, value, where).parameters) for value in (variable.lower, variable.upper)
    ]
    if np.count_nonzero(ends[0] != ends[1]) != 1 or ends[0][row] == ends[1][row]:
        raise InvalidLayout(
            f"{where}: '{name}' moves other numbers of the law too (c1=None of an airbag follows c0, length "
            "and onset). Give these"
        )
    if name not in _TIMES:
        return
    inner = law.law if isinstance(law, Timed) and name not in ("start", "end") else law
    width = (
        inner.sigma**-0.5
        if isinstance(inner, Impulse) and inner.sigma > 0.0
        else getattr(inner, "rise", np.inf)
    )
    if width < _RESOLVED * step:
        raise InvalidLayout(
            f"{where}: it is switched within {width:.3g} s, and the steps of {step:.3g} s do not see when. "
            f"Take a rise (or 1/sqrt(sigma)) of {_RESOLVED:g} steps at least, or more steps"
        )


def _moved(variable: LawVariable, law: Any, value: float, where: str) -> Any:
    try:
        return variable.moved(law, value)
    except ValueError as error:
        raise InvalidLayout(f"{where} cannot be {value:g} {variable.unit}: {error}") from error


def extended_gradients(
    trajectory: AnyTrajectory, objectives: Sequence[Any], variables: Sequence[LawVariable]
) -> Array:
    """(R, N + K) gradients of objectives of one run by densities and by the shares of the variables.

    One backward sweep a row gives both. What an objective sees of the law itself, the force of a member for
    example, is added by `parameter_slopes`.
    """
    count = len(trajectory.density)
    out = np.empty((len(objectives), count + len(variables)))
    laws = [member.law for member in trajectory.system.members]
    for row, objective in enumerate(objectives):
        found = parameter_gradient(trajectory, objective)
        out[row, :count] = found.density
        told = parameter_slopes(trajectory, objective, _around(trajectory, objective, variables))
        for k, variable in enumerate(variables):
            slope = told.get(variable.name)
            if slope is None:
                slope = sum(found.law[laws[i].names.index(variable.of(laws[i])), i] for i in variable.members)
            out[row, count + k] = slope * (variable.upper - variable.lower)
    return out


def _around(trajectory: AnyTrajectory, objective: Any, variables: Sequence[LawVariable]) -> dict[str, Any]:
    """The variables that an objective sees of itself, as `parameter_slopes` takes them."""
    quantity, system = getattr(objective, "quantity", None), trajectory.system
    seen = [
        variable for variable in variables
        if isinstance(quantity, StoredEnergy)
        or (isinstance(quantity, MemberForce) and quantity.member in variable.members)
    ]  # fmt: skip

    def of(variable: LawVariable) -> tuple[float, Any]:
        law = system.members[variable.members[0]].law
        now = law.parameters[law.names.index(variable.of(law))]
        return now, lambda value: with_values(system, (variable,), (value,))

    return {variable.name: of(variable) for variable in seen}

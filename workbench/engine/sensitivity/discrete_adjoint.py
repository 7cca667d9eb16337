"""The discrete adjoint of generalised-alpha: the exact gradient of the computed objective, for any number of
members.

Backwards over the steps, with the transposed matrices of the forward run at its converged states; see
`_kernels_alpha`. Cost: about half a forward run, whatever the number of members. It holds for the index-3 DAE
too,
where the source had no adjoint (its claim that an adjoint is not available is refuted here).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..multibody._kernels_alpha import alpha_adjoint
from ..multibody._kernels_equations import contract_history, contract_parameter_history
from ..multibody.compiled import compiled
from ..multibody.equations import PlanarEquations
from ..multibody.objectives import Objective
from ..multibody.quantities import in_member_order
from ..multibody.runge_kutta import runge_kutta_adjoint
from ..multibody.schemes import BDF2, GeneralisedAlpha, RungeKutta8, VelocityVerlet
from ..multibody.simulation import proximal
from ..multibody.stepping import alpha_adjoint_loop, bdf2_adjoint_loop
from ..multibody.trajectory import Trajectory
from .seeds import Seeds, seeds

__all__ = ["ByParameter", "discrete_adjoint", "parameter_gradient"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ByParameter:
    """Gradient with respect to everything that has a number.

    density: (N,).  law: (9, N) by the law's parameters, row j as in `law.names`.  natural_length: (N,).
    spring: (6, joint springs) by k, c, rest, k_stop, upper, lower.  bushing: (4, bushings) by k, c, cap,
    hold.
    mass, inertia: (free bodies,).
    """

    density: Array
    law: Array
    natural_length: Array
    spring: Array
    bushing: Array
    mass: Array
    inertia: Array


def discrete_adjoint(trajectory: Trajectory, objective: Objective) -> Array:
    """(N,) dG/dalpha of the computed objective, exact to rounding."""
    start = seeds(trajectory, objective)
    if isinstance(trajectory.scheme, RungeKutta8):
        gradient = _explicit(trajectory, start)
    elif isinstance(trajectory.scheme, BDF2) or not compiled(trajectory.system).fused:
        gradient = _looped(trajectory, start)
    else:
        gradient, _ = _sweep(trajectory, start, detailed=False)
    return np.asarray(in_member_order(trajectory, gradient) + start.density)


def parameter_gradient(trajectory: Trajectory, objective: Objective) -> ByParameter:
    """The same sweep, contracted with every parameter of members, springs, bushings and bodies.

    The objective's explicit dependence on a parameter other than density (stored energy on k, say) is not
    included. Raises NotSupported for runs of BDF2 and RungeKutta8 and for systems with a UserLaw.
    """
    if not isinstance(trajectory.scheme, GeneralisedAlpha | VelocityVerlet):
        raise NotSupported(
            f"parameter_gradient needs a run of GeneralisedAlpha or VelocityVerlet, got one of "
            f"{type(trajectory.scheme).__name__}; simulate again with GeneralisedAlpha, or take gradient() "
            "for the densities alone"
        )
    parts = compiled(trajectory.system)
    if not parts.fused:
        first = int(parts.order[parts.user[0].first])
        raise NotSupported(
            f"parameter_gradient knows the parameters of the engine's own laws only; members[{first}] has a "
            "UserLaw. Take gradient() for the densities, or differences for the parameters of that law"
        )
    start = seeds(trajectory, objective)
    gradient, (law, length, spring, bushing, mass) = _sweep(trajectory, start, detailed=True)
    order = np.argsort(parts.order)
    return ByParameter(
        density=in_member_order(trajectory, gradient) + start.density,
        law=law[:, order],
        natural_length=length[order],
        spring=spring,
        bushing=bushing[:4],
        mass=mass.reshape(-1, 3)[:, :2].sum(axis=1),
        inertia=mass.reshape(-1, 3)[:, 2],
    )


def _explicit(trajectory: Trajectory, start: Seeds) -> Array:
    """Order 8: accelerations are functions of the state, w = -M^-1 F, not states of their own."""
    if start.acceleration.any():
        raise NotSupported(
            "objectives of the acceleration have no adjoint under RungeKutta8; use GeneralisedAlpha"
        )
    return runge_kutta_adjoint(trajectory, start.last, start.position, start.velocity)


def _looped(trajectory: Trajectory, start: Seeds) -> Array:
    """BDF2, and systems with users' laws: the loops written in Python."""
    r = trajectory
    equations = PlanarEquations(compiled(r.system), r.tables)
    if isinstance(r.scheme, BDF2):
        return bdf2_adjoint_loop(equations, r.step, r, start)
    if isinstance(r.scheme, RungeKutta8):
        return _explicit(r, start)
    return alpha_adjoint_loop(equations, r.scheme, r.step, r, start)


def _kept(trajectory: Trajectory, n: int, m: int) -> tuple[Array, Array, Array]:
    """The tangents that the forward run kept; empty arrays when it kept none."""
    kept = trajectory.tangents
    if kept is None:
        return np.empty((0, n, n)), np.empty((0, n, n)), np.empty((0, m, n))
    return kept.stiffness, kept.damping, kept.jacobian


def _sweep(trajectory: Trajectory, start: Seeds, *, detailed: bool) -> tuple[Array, tuple[Array, ...]]:
    scheme = trajectory.scheme
    if not isinstance(scheme, GeneralisedAlpha | VelocityVerlet):
        raise NotSupported(f"no discrete adjoint for {type(scheme).__name__}")
    r, tables = trajectory, trajectory.tables
    n, m, bushings = r.position.shape[1], r.multiplier.shape[1], r.damage.shape[1]
    total, count = n + m, len(r.density)
    gradient = np.zeros(count)
    law, length = np.zeros((9, count if detailed else 0)), np.zeros(count if detailed else 0)
    spring = np.zeros((6, len(tables.torsion_pair)))
    bushing, mass = np.zeros((5, bushings)), np.zeros(n)
    shift = proximal(tables, redundant=len(r.diagnosis.redundant_rows) > 0)
    work = r.work
    mu = np.zeros_like(r.position)
    alpha_adjoint(
        tables, work, scheme.numbers, r.step, start.last,
        r.position, r.velocity, r.multiplier, r.damage, r.damage_rate,
        start.position, start.velocity, start.acceleration, start.multiplier, start.damage,
        np.zeros((total, total)), np.zeros((total, total) if shift else (0, 0)), np.zeros(total),
        np.zeros(2 * total), np.zeros(total, np.int64), shift, np.zeros((4, n)), np.zeros((2, bushings)), mu,
        *_kept(r, n, m),
    )  # fmt: skip
    contract_history(tables, work, start.last, r.position, r.velocity, mu, gradient)
    if detailed:
        contract_parameter_history(
            tables, work, start.last, r.position, r.velocity, r.acceleration, r.damage, mu,
            law, length, spring, bushing, mass, np.zeros(9), np.zeros((5, 3)),
        )  # fmt: skip
    return gradient, (law, length, spring, bushing, mass)

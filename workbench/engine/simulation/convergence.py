"""Is the step fine enough? A second run with half the step, and Richardson's estimate of the error left.

And which scheme to take: `choose_scheme` says why.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..integration.redundancy import redundancy
from ..integration.schemes import (
    BDF2,
    GeneralisedAlpha,
    RungeKutta8,
    Scheme,
    VelocityVerlet,
)
from ..objectives.reductions import Objective
from ..planar.compiled import compiled, on_grid
from ..planar.equations import SampledEquations
from ..planar.start import check_start
from ..planar.system import System
from .simulate import simulate

__all__ = ["Choice", "Convergence", "choose_scheme", "convergence"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Convergence:
    """An objective at a step and at half of it, and the error estimated for the coarser run."""

    value: float
    finer: float
    extrapolated: float
    relative_error: float
    order: int
    steps: int
    tolerance: float

    @property
    def fine_enough(self) -> bool:
        """Whether the estimated error is within the tolerance."""
        return self.relative_error <= self.tolerance

    @property
    def advice(self) -> str:
        """What to do, in a sentence."""
        if self.fine_enough:
            return (
                f"{self.steps} steps are fine enough: estimated relative error {self.relative_error:.1e} "
                f"(tolerance {self.tolerance:.0e})"
            )
        factor = (self.relative_error / self.tolerance) ** (1.0 / self.order)
        return (
            f"{self.steps} steps leave an estimated relative error of {self.relative_error:.1e}; for "
            f"{self.tolerance:.0e} take about {int(np.ceil(self.steps * factor))}"
        )


def convergence(
    system: System,
    density: Array,
    objective: Objective,
    *,
    t_end: float,
    steps: int,
    scheme: Scheme | None = None,
    tolerance: float = 1e-3,
) -> Convergence:
    """Run with `steps` and twice as many, and estimate the error of the first by Richardson's rule.

        error ~ (G_h - G_{h/2}) 2^p/(2^p - 1),   p the order of the scheme

    Holds where the forces are smooth on the scale of a step.
    """
    scheme = GeneralisedAlpha() if scheme is None else scheme
    order = 8 if isinstance(scheme, RungeKutta8) else 2
    coarse, fine = (
        objective.value(simulate(system, density, t_end, count, scheme=scheme))
        for count in (steps, 2 * steps)
    )
    difference = (fine - coarse) / (2**order - 1)
    extrapolated = fine + difference
    scale = max(abs(extrapolated), np.finfo(float).tiny)
    return Convergence(
        value=coarse, finer=fine, extrapolated=extrapolated,
        relative_error=abs(coarse - extrapolated) / scale,
        order=order, steps=steps, tolerance=tolerance,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A scheme and the reason for it."""

    scheme: GeneralisedAlpha | VelocityVerlet | BDF2 | RungeKutta8
    reason: str


def choose_scheme(system: System, density: Array, *, t_end: float, steps: int) -> Choice:
    """Choose by joints, smoothness and the fastest mode at the start against the step.

    >>> from workbench.engine import Body, Member, Spring, System
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0)
    >>> spring = Member(a="mass", b="ground", point_b=(-1, 0), law=Spring(k=10.0))
    >>> system = System(bodies=(mass,), members=(spring,))
    >>> choose_scheme(system, [1.0], t_end=1.0, steps=100).scheme
    RungeKutta8()
    """
    parts = compiled(system)
    alpha = np.asarray(density, float)
    tables = on_grid(parts, alpha, np.zeros(1))
    q, v, phi_q = check_start(parts, tables)
    lost = redundancy(parts.row_names, phi_q).rows
    if lost:
        return Choice(
            scheme=GeneralisedAlpha(rho=0.8),
            reason=f"redundant joint rows ({'; '.join(lost)}) need the implicit scheme",
        )
    if len(phi_q):
        return Choice(
            scheme=GeneralisedAlpha(), reason="joints make it an index-3 differential-algebraic system"
        )
    if not parts.fused:
        return Choice(scheme=GeneralisedAlpha(), reason="a user's law is not known to be smooth")
    if not system.smooth:
        return Choice(scheme=GeneralisedAlpha(), reason="rounded kinks or breakable bushings spoil order 8")
    equations = SampledEquations(parts, tables)
    equations.look(0, q, v, np.zeros(0))
    root = 1.0 / np.sqrt(tables.mass)
    n = len(q)
    companion = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [
                -root[:, None] * equations.stiffness * root,
                -root[:, None] * equations.damping * root,
            ],
        ]
    )
    fastest = float(np.abs(np.linalg.eigvals(companion)).max())
    h = t_end / steps
    if fastest * h > 2.0:
        return Choice(
            scheme=GeneralisedAlpha(),
            reason=f"the fastest mode, {fastest:.3g} rad/s, is too stiff for an explicit step of {h:.3g} s",
        )
    return Choice(
        scheme=RungeKutta8(),
        reason=f"smooth, without joints, fastest mode {fastest:.3g} rad/s: order 8 pays at {h:.3g} s",
    )

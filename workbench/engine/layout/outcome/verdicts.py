"""What the numbers of an optimisation mean, in plain sentences."""

import numpy as np
from numpy.typing import NDArray

from ..formulation.law_variables import values_at
from ..formulation.problem import LayoutProblem
from .history import Recorder
from .limits import limit_sentence
from .purify import fractional_members
from .result import FIRST_ORDER, Contradiction, LayoutStatus, LimitOutcome

__all__ = ["verdicts"]

Array = NDArray[np.float64]

_NEAR = 0.02
_EXACT = 1e-5  # first-order error up to which a convex optimum is called the optimum


def verdicts(
    problem: LayoutProblem, recorder: Recorder, status: LayoutStatus, kkt: float, prices: Array,
    baselines: dict[str, float], proof: Contradiction | None = None,
    limits: tuple[LimitOutcome, ...] = (),
) -> tuple[str, ...]:  # fmt: skip
    """Sentences on why it stopped, the budgets, other optima and trivial layouts."""
    said = [status.value]
    density = recorder.best_density
    if status is LayoutStatus.ZERO_SENSITIVITY:
        at = _peak_time(problem, recorder)
        return (*said, f"The largest value occurs {at}; before it no member has changed the motion. "
                "Look at a later window, or at another objective.")  # fmt: skip
    if proof is not None:
        return (*said, _contradicted(proof))
    if density is None:
        return (*said, f"The least violation seen is {recorder.nearest:.3g}, in the unit of the constraint"
                f"{' (1 is the size of the limit)' if recorder.limited else ''}. "
                "Give a feasible start, relax the constraints, or allow more evaluations.")  # fmt: skip
    if np.isfinite(kkt):
        said.append(_first_order(problem, recorder, status, kkt))
    failed = sum(not np.isfinite(entry.value) for entry in recorder.history)
    if failed:
        said.append(f"At {failed} trial designs the model failed; these steps were refused.")
    said += _budgets(problem, density, recorder.best, prices)
    said += [limit_sentence(limit, recorder.best, problem.unit) for limit in limits]
    near = sorted({round(v, 12) for v in recorder.optima if v <= recorder.best * (1 + _NEAR)})
    if len(near) > 1:
        said.append(
            f"{len(near)} local optima lie within {100 * _NEAR:.0f} % of each other, from {near[0]:.6g} to "
            f"{near[-1]:.6g}: other considerations may choose between these layouts."
        )
    if recorder.ends:
        said.append(
            f"Searches from {len(recorder.ends)} starts came to {min(recorder.ends):.6g} to "
            f"{max(recorder.ends):.6g}, that from the start given to {recorder.ends[0]:.6g}; those that "
            "promised less than the best were not followed to their ends."
        )
    if recorder.probes:
        said.append(
            f"{recorder.probes} runs without gradients looked for starts and corrected steps, beside the "
            f"{recorder.evaluations} evaluations."
        )
    if not problem.convex:
        said.append(
            "A better layout cannot be ruled out: the response is not convex in the densities, and there is "
            "no lower bound for it."
        )
    active = recorder.history[
        int(np.argmin([h.value if h.best == h.value else np.inf for h in recorder.history]))
    ].active
    if active > 1:
        said.append(f"{active} peaks compete within 1 %; a gradient of one of them alone would mislead.")
    for name, value in baselines.items():
        if value == recorder.best:
            said.append(f"The trivial layout '{name}' is the best one found.")
    for variable, value in zip(problem.variables, values_at(problem, density).values(), strict=True):
        said.append(
            f"'{variable.name}' is {value:.4g} {variable.unit}, of {variable.lower:g} to {variable.upper:g}."
        )
    count = fractional_members(problem, density)
    said.append(
        f"{count} of {problem.densities} members are neither at their lower nor at their upper bound."
    )
    return tuple(said)


def _first_order(problem: LayoutProblem, recorder: Recorder, status: LayoutStatus, kkt: float) -> str:
    assert recorder.best_evaluation is not None
    bounded = problem.convex and (
        problem.convex_constraints or recorder.best_evaluation.constraints.size == 0
    )
    if bounded and kkt <= _EXACT:
        return f"The rows are convex: this is the optimum, to {kkt:.2g} of its value."
    said = f"To first order at most {100 * kkt:.2g} % of the value is left to gain"
    if bounded:
        said = f"The rows are convex: no design is better by more than {100 * kkt:.2g} % of the value"
    if status is LayoutStatus.STALLED:
        said += f"; converged would mean at most {100 * FIRST_ORDER:g} %"
    return said + "."


def _contradicted(proof: Contradiction) -> str:
    count = np.unique(proof.constraints).size
    which = ", ".join(str(k) for k in np.unique(proof.constraints)[:5]) + (", ..." if count > 5 else "")
    budgets = " and of the budgets" if (proof.budgets > 0).any() else ""
    return (
        f"A weighted sum of constraint{'s' if count > 1 else ''} {which}{budgets} is at least "
        f"{proof.least:.3g} at every design within the bounds, and would need to be 0 or less. Relax these."
    )


def _budgets(problem: LayoutProblem, density: Array, value: float, prices: Array) -> list[str]:
    said = []
    unit = "" if problem.unit == "1" else f" {problem.unit}"
    usage = problem.usage(density)
    for name, used, price, limit in zip(problem.names, usage, prices, problem.limits, strict=True):
        if used < 0.999 and price * abs(limit) <= 1e-6 * abs(value):
            said.append(
                f"'{name}' is idle: {100 * used:.3g} % used at shadow price 0. "
                "More of it is worth nothing here."
            )
        else:
            said.append(
                f"'{name}' is {100 * used:.4g} % used; 1 % more of it would lower the value by about "
                f"{price * 0.01 * abs(limit):.3g}{unit}."
            )
    return said


def _peak_time(problem: LayoutProblem, recorder: Recorder) -> str:
    assert recorder.best_evaluation is not None
    values = np.atleast_2d(recorder.best_evaluation.values)
    scenario, node = np.unravel_index(int(values.argmax()), values.shape)
    return problem.where(int(scenario), int(node))

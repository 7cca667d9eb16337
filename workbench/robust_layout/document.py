"""`layout.json`: a layout of the engine in plain numbers and sentences, and the check of its gradient."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.formulation.member_names import member_names
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.outcome.purify import PurifiedLayout, fractional_members
from workbench.engine.layout.outcome.result import LayoutResult
from workbench.engine.layout.whole_members import WholeLayout

__all__ = ["check_gradient", "finite", "layout_document", "layout_members"]

Array = NDArray[np.float64]

STEP = 1e-6  # of the bounds' width in the gradient check


def layout_document(
    problem: LayoutProblem,
    result: LayoutResult,
    *,
    name: str,
    method: str,
    history: list[dict[str, Any]],
    start_value: float,
    check: Mapping[str, float],
    clean: PurifiedLayout | None,
    baselines: tuple[Mapping[str, float], Mapping[str, float]],
    whole: WholeLayout | None = None,
) -> dict[str, Any]:
    """The content of `layout.json`: plain numbers and sentences, no NaN.

    baselines: values of the trivial layouts within the budgets, and of those beyond them.
    """
    return {
        "problem": name,
        "title": problem.title,
        "response": problem.response,
        "unit": problem.unit,
        "length_unit": "m",
        "method": method,
        "strategy": result.strategy,
        "value": result.value,
        "start_value": start_value,
        "status": result.status.value,
        "converged": result.status.name == "CONVERGED",
        "kkt": finite(result.kkt),
        "evaluations": len(history),
        "shadow_prices": dict(zip(problem.names, result.shadow_prices.tolist(), strict=True)),
        "budgets": [
            {"name": budget, "limit": float(limit), "used": float(used)}
            for budget, limit, used in zip(
                problem.names, problem.limits, problem.costs @ result.density, strict=True
            )
        ],
        "limits": [
            {
                "name": limit.name, "bound": limit.bound, "upper": limit.upper, "value": limit.value,
                "unit": limit.unit, "scenario": limit.scenario, "time": finite(limit.time),
                "price": limit.price,
            }
            for limit in result.limits
        ],
        "density": result.density.tolist(),
        "grayness": result.grayness,
        "fractional": fractional_members(problem, result.density),
        "members": layout_members(problem, result.density),
        "history": history,
        "baselines": dict(baselines[0]),
        "beyond_budget": dict(baselines[1]),
        "purified": None if clean is None else {
            **{k: v for k, v in asdict(clean).items() if k != "density"},
            "density": clean.density.tolist(), "loss": clean.loss,
        },
        "whole": None if whole is None else _whole(whole),
        "gradient_check": dict(check),
        "verdicts": list(result.verdicts),
        "optima": list(result.optima),
    }  # fmt: skip


def _whole(found: WholeLayout) -> dict[str, Any]:
    return {
        "members": list(found.members), "value": finite(found.value), "density": found.density.tolist(),
        "relaxed": finite(found.relaxed), "price_of_rounding": finite(found.price_of_rounding),
        "bound": finite(found.bound), "evaluations": found.evaluations, "status": found.status.value,
        "verdicts": list(found.verdicts),
        "runners_up": [{"value": value, "members": list(members)} for value, members in found.runners_up],
    }  # fmt: skip


def check_gradient(problem: LayoutProblem, *, seed: int = 0) -> dict[str, float]:
    """Relative error of the gradient of the largest row along a random direction, by central differences."""
    rng = np.random.default_rng(seed)
    width = problem.upper - problem.lower
    density = np.clip(problem.start, problem.lower + 2 * STEP * width, problem.upper - 2 * STEP * width)
    direction = rng.standard_normal(problem.members) * width
    evaluation = problem.checked(density)
    row = int(np.argmax(evaluation.values))
    slope = float(problem.checked_gradients(evaluation, np.array([row]))[0] @ direction)
    largest = float(np.abs(direction / np.where(width > 0, width, 1.0)).max())
    h = STEP / largest
    ahead, behind = (
        np.ravel(problem.checked(density + side * h * direction).values)[row] for side in (1.0, -1.0)
    )
    difference = float(ahead - behind) / (2 * h)
    return {"central difference": abs(slope - difference) / max(abs(slope), abs(difference), 1e-300)}


def layout_members(problem: LayoutProblem, density: Array) -> list[dict[str, Any]]:
    """Name, kind, density and ends of every member, as `layout.json` lists them."""
    geometry = problem.geometry
    density = density[: problem.densities]
    if geometry is None:
        names = member_names(["member"] * len(density))
        return [{"name": names[i], "kind": "member", "density": float(a)} for i, a in enumerate(density)]
    names = member_names(geometry.kind, geometry.names)
    return [
        {
            "name": names[i], "kind": geometry.kind[i], "density": float(a),
            "body_a": int(geometry.body_a[i]), "point_a": geometry.point_a[i].tolist(),
            "body_b": int(geometry.body_b[i]), "point_b": geometry.point_b[i].tolist(),
            "a": geometry.point_a[i].tolist(), "b": geometry.point_b[i].tolist(),
        }
        for i, a in enumerate(density)
    ]  # fmt: skip


def finite(value: float) -> float | None:
    """The number, or None where JSON has none for it."""
    return float(value) if np.isfinite(value) else None

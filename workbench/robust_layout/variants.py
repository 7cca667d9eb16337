"""Other layout problems for the cases of a robust loop: optimised, judged in all cases, purified, priced."""

from pathlib import Path
from typing import Any

from workbench.errors import HoldfastError
from workbench.robust_layout.cases import Optimised, optimise_for_cases
from workbench.robust_layout.loop import NEAR
from workbench.robust_layout.loop_documents import response_slope
from workbench.robust_layout.model import LayoutModel
from workbench.robust_layout.record import RobustLayout, near_the_largest

__all__ = ["variant_document"]


def variant_document(
    model: LayoutModel, found: RobustLayout, *, folder: Path, evaluations: int, identity: str
) -> dict[str, Any]:
    """The layout of another problem for the cases of the loop; `failure` says why there is none.

    Args:
        folder: where optimised layouts are kept.    evaluations: of the optimiser.
        identity: changes when the problem changes, so that stored layouts are not taken for current.
    """
    robust = found.layouts[found.robust]
    made = optimise_for_cases(
        model, _near_cases(found), start=robust if model.members == len(robust) else None, folder=folder,
        evaluations=evaluations, identity=identity,
    )  # fmt: skip
    return {"failure": made} if isinstance(made, str) else _judged(model, made, found)


def _judged(model: LayoutModel, made: Optimised, found: RobustLayout) -> dict[str, Any]:
    values: list[float | None] = []
    for case in found.cases:
        try:
            values.append(float(model.responses(made.density, case)[model.response]))
        except (HoldfastError, ArithmeticError, ValueError, RuntimeError):
            values.append(None)  # the case stays in the table, without a value
    document, clean = made.document, made.document.get("purified")
    value = float(document["value"])
    slope = response_slope(model, value)
    return {
        "worst": max((v for v in values if v is not None), default=None),
        "values": values,
        "status": document["status"],
        "evaluations": document["evaluations"],
        "budgets": document["budgets"],
        "shadow_prices": {name: price * slope for name, price in document["shadow_prices"].items()},
        "fractional": document["fractional"],
        "purified": None if clean is None else {
            "value": model.as_response(clean["value"]), "fractional": clean["fractional"],
            "loss": _loss(model.as_response(clean["value"]), model.as_response(clean["before"])),
        },
    }  # fmt: skip


def _loss(value: float, before: float) -> float:
    """Relative change of a response, positive when it got worse, whatever its sign; the change from 0."""
    return (value - before) / (abs(before) or 1.0)


def _near_cases(found: RobustLayout) -> list[dict[str, Any]]:
    """The cases in which the robust layout comes near its bound; the others cost time and change nothing."""
    values = found.values[found.robust]
    high = near_the_largest(values, NEAR)
    near = [c for c, v in zip(found.cases, values, strict=True) if v is None or v >= high]
    return near or found.cases[:1]

"""The bill of materials of a layout as documents: plain numbers for JSON, and one line per member for CSV."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.formulation.problem import FAILURES, LayoutProblem
from workbench.engine.layout.outcome.bill_of_materials import Bill, BillEntry, Extreme, bill_of_materials
from workbench.robust_layout.model import LayoutModel
from workbench.system.atomic import write_json, write_text

__all__ = ["CSV", "JSON", "bill_csv", "bill_document", "layout_bill", "robust_bill", "write_bill"]

Array = NDArray[np.float64]

JSON, CSV = "bill_of_materials.json", "bill_of_materials.csv"
EXTREMES = {
    "tension": "N", "compression": "N", "stretch": "m", "shortening": "m", "energy": "J",
}  # fmt: skip
AXES = "xyz"


def bill_document(bill: Bill) -> dict[str, Any]:
    """The bill in plain numbers: `members` thickest first, `bodies` for drawings, names of budgets and
    scenarios.
    """
    return {
        "members": [_entry(entry, bill) for entry in bill.entries],
        "left_out": {
            "members": bill.left_out,
            "shares": dict(zip(bill.budgets, bill.left_out_share.tolist(), strict=True)),
        },
        "budgets": list(bill.budgets),
        "scenarios": list(bill.scenarios),
        "bodies": [{"name": body.name, "points": body.points.tolist()} for body in bill.bodies],
        "units": {"length": "m", "force": "N", "energy": "J", "time": "s"},
    }


def _entry(entry: BillEntry, bill: Bill) -> dict[str, Any]:
    def extreme(found: Extreme) -> dict[str, Any]:
        return {"value": found.value, "time": found.time, "scenario": bill.scenarios[found.scenario]}

    return {
        "member": entry.number, "name": entry.name, "kind": entry.kind,
        "body_a": entry.body_a, "a": entry.point_a.tolist(),
        "body_b": entry.body_b, "b": entry.point_b.tolist(),
        "length": entry.length, "density": entry.density,
        "shares": dict(zip(bill.budgets, entry.shares.tolist(), strict=True)),
        **{name: extreme(getattr(entry, name)) for name in EXTREMES},
    }  # fmt: skip


def bill_csv(document: Mapping[str, Any]) -> str:
    """One line per member; lengths in m, forces in N, energies in J, times in s."""
    budgets = list(document["budgets"])
    members = list(document["members"])
    axes = AXES[: len(members[0]["a"])] if members else AXES
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([
        "member", "name", "kind", "body_a", *(f"a_{x} [m]" for x in axes), "body_b",
        *(f"b_{x} [m]" for x in axes), "length [m]", "density", *(f"share of {name}" for name in budgets),
        *(part for name, unit in EXTREMES.items() for part in (
            f"{name} [{unit}]", f"{name} at [s]", f"{name} in"
        )),
    ])  # fmt: skip
    for m in members:
        writer.writerow([
            m["member"], m["name"], m["kind"], m["body_a"], *m["a"], m["body_b"], *m["b"], m["length"],
            m["density"], *(m["shares"][name] for name in budgets),
            *(m[name][key] for name in EXTREMES for key in ("value", "time", "scenario")),
        ])  # fmt: skip
    return out.getvalue()


def layout_bill(problem: LayoutProblem, density: Array) -> dict[str, Any] | None:
    """The document of a layout's bill; None for a problem without runs, or where a scenario cannot be run."""
    if problem.simulated is None:
        return None
    try:
        return bill_document(bill_of_materials(problem, density))
    except FAILURES:
        return None


def robust_bill(
    model: LayoutModel, cases: Sequence[Mapping[str, Any]], density: Array
) -> dict[str, Any] | None:
    """The bill of a layout model over uncertain cases; None where the model has no runs for all of them."""
    try:
        problem = model.problem(cases)
    except FAILURES:
        return None
    return layout_bill(problem, density)


def write_bill(folder: Path, document: Mapping[str, Any] | None) -> None:
    """`bill_of_materials.json` and `bill_of_materials.csv`; without a bill those of an older layout go."""
    if document is None:
        (folder / JSON).unlink(missing_ok=True)
        (folder / CSV).unlink(missing_ok=True)
        return
    write_json(folder / JSON, dict(document))
    write_text(folder / CSV, bill_csv(document))

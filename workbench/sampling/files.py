"""A design as a CSV for people and other programs, with a JSON side-car that brings it back whole.

`plan.csv` holds run_id, block where there are blocks, and the physical values in the parameters' units;
`plan.csv.json` holds units, bounds, constraints, provenance and the unit coordinates. Both are written
whole and renamed.
"""

import csv
import json
from io import StringIO
from pathlib import Path

from workbench.errors import StudyError
from workbench.sampling.plan import Design
from workbench.system.atomic import write_text

__all__ = ["read_design", "write_design"]


def write_design(design: Design, path: str | Path) -> Path:
    """Write `path` and `path`.json; returns the path of the CSV."""
    target = Path(path)
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    blocks = ["block"] if design.block else []
    writer.writerow(["run_id", *blocks, *design.space.names])
    for k, (name, row) in enumerate(zip(design.run_ids, design.rows(), strict=True)):
        writer.writerow([name, *([design.block[k]] if blocks else []), *row.values()])
    write_text(target, text.getvalue())
    write_text(_side_car(target), json.dumps(design.to_dict(), indent=1) + "\n")
    return target


def read_design(path: str | Path) -> Design:
    """The design that `write_design` wrote; the CSV decides which runs are left and in which order.

    Raises: StudyError when the side-car is missing, or a value in the CSV is not the one that was written.
    """
    target = Path(path)
    side = _side_car(target)
    if not target.is_file() or not side.is_file():
        missing = target if not target.is_file() else side
        raise StudyError(f"{missing} is missing; a design is a CSV and the .json beside it")
    design = Design.from_dict(json.loads(side.read_text(encoding="utf-8")))
    with target.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    written = {
        name: {key: str(value) for key, value in row.items()}
        for name, row in zip(design.run_ids, design.rows(), strict=True)
    }
    for number, row in enumerate(rows, start=2):
        name = row.get("run_id", "")
        if name not in written:
            raise StudyError(f"{target}, line {number}: run {name!r} is not in {side.name}")
        for key, value in written[name].items():
            if row.get(key) != value:
                raise StudyError(
                    f"{target}, line {number}: {key} is {row.get(key)!r}, {side.name} has {value!r};"
                    " designs are not edited by hand, make a new one"
                )
    return design.subset(row["run_id"] for row in rows)


def _side_car(path: Path) -> Path:
    return path.with_name(path.name + ".json")

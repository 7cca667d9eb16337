"""Do the claims about tables of runs hold against the tables themselves?

Tables are drawn at random: 1 to 4 parameters, 8 to 30 rows, one or two responses that are smooth, of high
powers, negative or blow up near an end, some without a value, columns that no study lists, rows that the
design leaves out. Every study asks for the worst of one response (also within limits of the other), of both,
or of their sum. The documents and the page are then compared with the CSV, read here by plain Python:

    a row of the table that is worse than the stated worst case
    a bound on the wrong side of its value
    an unlisted column of numbers that the terminal or the page does not name, or a listed one that they do

`python -m studies.tables_of_runs 200 7` prints what contradicts itself in 200 tables of seed 7, and how many;
a page is made of every eighth.
"""

import csv
import json
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from workbench.report.lines.design import design_lines
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import report, run_stage

__all__ = ["Drawn", "contradictions", "drawn_study"]

ROUNDING = 1e-9
PAGES = 8
SHAPES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "smooth": lambda s: np.sin(2 * s) + s,
    "power": lambda s: s**5,
    "negative": lambda s: -5.0 - s**2,
    "blow-up": lambda s: 1.0 / (3.05 - s),
    "flat": lambda s: np.round(s),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A study file beside its table, the way of its question, and the columns of numbers that it leaves."""

    path: Path
    way: str
    ignored: tuple[str, ...]


def drawn_study(seed: int, number: int, folder: Path) -> Drawn:
    """Draw a table and a study of it, and write both into the folder."""
    rng = np.random.default_rng((seed, number))
    d, n = int(rng.integers(1, 5)), int(rng.integers(8, 31))
    names = [f"p{j}" for j in range(d)]
    x = rng.uniform(-1, 2, (n, d))
    s = x @ rng.uniform(0.2, 1.0, d) / np.sqrt(d)
    y = SHAPES[str(rng.choice(list(SHAPES)))](s) + 1e-3 * np.arange(n)
    z = -2.0 * s**3 + x[:, 0] + 1e-3 * rng.random(n)
    cells = {name: [repr(v) for v in x[:, j].tolist()] for j, name in enumerate(names)}
    cells |= {"y": [repr(v) for v in y.tolist()], "z": [repr(v) for v in z.tolist()]}
    for name in ("y", "z"):
        for k in rng.choice(n, int(rng.integers(0, n // 4)), replace=False):
            cells[name][k] = str(rng.choice(["", "nan", "inf"]))
    ignored: list[str] = []
    if rng.random() < 0.7:
        cells["temperature"] = [repr(v) for v in rng.normal(20, 5, n).tolist()]
        ignored.append("temperature")
    if rng.random() < 0.3:
        cells["who"] = [str(w) for w in rng.choice(["anna", "ben"], n)]
    way = str(rng.choice(["one", "within", "both", "sum"]))
    responses = ["y"] if way == "one" and rng.random() < 0.5 else ["y", "z"]
    if "z" not in responses:
        ignored.append("z")
    sense = str(rng.choice(["max", "min"]))
    table = {
        "one": f'response = "y"\nsense = "{sense}"',
        "within": f'response = "y"\nsense = "{sense}"\nwithin = {{ z = [-3.0, inf] }}',
        "both": f'responses = {{ y = "{sense}", z = "min" }}',
        "sum": f'weights = {{ y = 1.0, z = 0.5 }}\nsense = "{sense}"',
    }[way]
    order = list(cells)
    rng.shuffle(order)
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "runs.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(order)
        writer.writerows(zip(*(cells[name] for name in order), strict=True))
    text = f'[study]\nname = "t{number}"\nseed = {number + 1}\n[model]\nkind = "table"\nfile = "runs.csv"\n'
    for name in names:
        text += f'[[parameter]]\nname = "{name}"\nlower = -1.0\nupper = 2.0\n'
    for name in responses:
        text += f'[[response]]\nname = "{name}"\nunit = "mm"\n'
    if rng.random() < 0.4:
        text += f'[design]\nkind = "table"\nruns = {int(rng.integers(n // 2 + 2, n))}\n'
    path = folder / "study.toml"
    path.write_text(f"{text}[worst_case]\n{table}\n")
    return Drawn(path=path, way=way, ignored=tuple(ignored))


def contradictions(drawn: Drawn, *, page: bool = True) -> list[str]:
    """Walk the study and compare what it says with its table; one sentence per contradiction."""
    with Campaign.from_file(drawn.path) as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        run_stage(campaign, "worst_case")
        written = report(campaign) if page else None
        folder = campaign.folder
    document = json.loads((folder / "worst_case.json").read_text())
    said = []
    for part in (document, *document.get("others", ())):
        sign = 1.0 if part["sense"] == "max" else -1.0
        worst = max((sign * v for v in _known(drawn, part)), default=-inf)
        if worst > sign * part["value"] + ROUNDING * abs(part["value"]):
            said.append(f"{part['response']}: {part['value']:.6g} stated, the table has {sign * worst:.6g}")
        upper = part["gap"]["upper"]
        if upper is not None and sign * upper < sign * part["value"] - ROUNDING * abs(part["value"]):
            said.append(f"{part['response']}: the bound {upper:.6g} of the value {part['value']:.6g}")
    lines = " ".join(design_lines(json.loads((folder / "design.json").read_text())))
    texts = {"terminal": lines}
    if written is not None:
        texts["page"] = written.read_text()
    for where, text in texts.items():
        for name in ("temperature", "z", "who"):
            is_named = (
                any(f"{word} of runs.csv" in text for word in (f"column {name}", f", {name}"))
                or f"columns {name}, " in text
            )
            if is_named != (name in drawn.ignored):
                said.append(f"{name} is {'named' if is_named else 'not named'} in the {where}")
    return said


def _known(drawn: Drawn, part: Mapping[str, Any]) -> list[float]:
    """The values of the table that count: what is searched, of the rows that have all that it reads."""
    with open(drawn.path.parent / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    values = []
    for row in rows:
        y, z = (_value(row[name]) for name in ("y", "z"))
        if drawn.way == "sum":
            value = y + 0.5 * z
        elif drawn.way == "within":
            value = y if z >= -3.0 else float("nan")
        else:
            value = y if part["response"] == "y" else z
        if isfinite(value):
            values.append(value)
    return values


def _value(cell: str) -> float:
    return float(cell) if cell and isfinite(float(cell)) else float("nan")


if __name__ == "__main__":
    count, seed = (int(text) for text in (*sys.argv[1:3], *("20", "7")[len(sys.argv) - 1 :]))
    total, refused = 0, 0
    for number in range(count):
        with tempfile.TemporaryDirectory() as folder:
            drawn = drawn_study(seed, number, Path(folder))
            try:
                found = contradictions(drawn, page=number % PAGES == 0)
            except Exception as exc:
                refused += 1
                print(f"{number}: refused: {type(exc).__name__}: {exc}", flush=True)
                continue
            total += len(found)
            for sentence in found:
                print(f"{number}: {sentence}", flush=True)
    print(f"{count} tables, {refused} refused, {total} contradictions")

"""Do runs at a longer step rank the cases of a layout as the true runs do? Scouts rest on that.

Random corners of a study's uncertainty, in layouts that are drawn (densities evenly between 0 and their
largest, brought into the budgets) and in the uniform one: the response by true runs, and by the model's
`coarsened`.

    error    of the response at the longer step, of the true one: median and largest
    places   where the four truly worst cases stand by the longer step, the worst first
    cost     processor time of a run at the longer step, of that of a true one

`python -m studies.longer_steps 200 4` prints the occupant, four layouts with 200 corners each;
`python -m studies.longer_steps 40 2 rollover` the gunner's rollover.
"""

import sys
import time
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.loop_rivals import drawn_case
from workbench.robust_layout.cases import trivial_layouts
from workbench.robust_layout.model import load_layout_model
from workbench.robust_layout.other_starts import random_densities
from workbench.space.box import Space
from workbench.study.loading import load_study

__all__ = ["STUDIES", "Compared", "compared"]

Array = NDArray[np.float64]

STUDIES = {
    "occupant": "occupant_demo.toml",
    "rollover": "gunner/restraints/restraint_rollover.toml",
}
WORST = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """Runs of one layout at both steps; what failed at either is left out of the errors."""

    median: float
    largest: float
    places: tuple[int, ...]
    failed: int
    cost: float


def compared(model: Any, space: Space, density: Array, *, corners: int, seed: int) -> Compared:
    """The true runs and those at the longer step of `corners` random corners."""
    rng = np.random.default_rng([seed, 254])
    rows = [drawn_case(space, rng, corner=True) for _ in range(corners)]
    values, spent = [], []
    for many in (model.responses_of_cases, model.coarsened):
        many(density, rows[:1], threads=1)  # what has to be compiled
        begun = time.process_time()
        answers = many(density, rows, threads=1)
        spent.append(time.process_time() - begun)
        values.append([np.nan if isinstance(a, Exception) else a[model.response] for a in answers])
    true, coarse = np.array(values)
    there = np.isfinite(true) & np.isfinite(coarse)
    true, coarse = true[there], coarse[there]
    error = np.abs(coarse / true - 1.0)
    worst = np.argsort(-true, kind="stable")[:WORST]
    return Compared(
        median=float(np.median(error)), largest=float(error.max()),
        places=tuple(int((coarse > coarse[k]).sum()) + 1 for k in worst),
        failed=int((~there).sum()), cost=spent[1] / spent[0] if spent[0] else 1.0,
    )  # fmt: skip


def main(corners: int, layouts: int, which: str) -> None:
    """Print a line for every layout."""
    study = load_study(str(files("studies") / STUDIES[which]))
    table = study.robust_layout or {}
    model = load_layout_model(table["model"], table["options"])
    problem = model.problem([study.space.canonical(table["nominal"])])
    made = {"uniform": trivial_layouts(problem)["uniform"]}
    made |= {f"drawn {seed}": random_densities(problem, seed=seed) for seed in range(1, layouts)}
    for seed, (name, density) in enumerate(made.items()):
        c = compared(model, study.space, density, corners=corners, seed=seed)
        print(
            f"{name:8} error {c.median:.1e}, {c.largest:.1e}   places {c.places}   cost {c.cost:.2f}   "
            f"failed {c.failed}",
            flush=True,
        )


if __name__ == "__main__":
    given = [text for text in sys.argv[1:] if text not in STUDIES]
    many, some = (*(int(text) for text in given), *(200, 4)[len(given) :])
    main(many, some, next((text for text in sys.argv[1:] if text in STUDIES), "occupant"))

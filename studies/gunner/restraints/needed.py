"""How much restraint a rollover asks for: belts and bags that keep the gunner in the hatch over a box.

    python -m studies.gunner.restraints.needed [cases of the box] [budgets, as 6,20,60]

For each budget (so many whole belts and as many airbags, no retractors) a layout is made for two cases, the
nominal one and a heavy man without hands on a rough road, from an even spread. Both are then run in the same
independent cases of the uncertainty of `restraint_rollover.toml`. Retained: he never rose above the hatch.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from workbench.engine import optimise_layout
from workbench.search.evidence.attack.share import Share, counted_share
from workbench.study.loading import load_study

from .model import GunnerRestraint, restraint

__all__ = ["BUDGETS", "HEAVY", "Needed", "independent_cases", "lines", "main", "needed"]

Array = np.ndarray[Any, Any]
Case = Mapping[str, Any]

BUDGETS = (6.0, 20.0, 60.0)
STEP = 1.25e-3  # s
SEED = 31
HEAVY: Case = {
    "hands": "none", "mass": 95.0, "friction": 1.3, "k_elbow": 0.5, "k_hip_tx": 0.5, "k_shoulder_tx": 0.5,
    "seat_rate": 20_000.0, "seat_cap": 1000.0,
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Needed:
    """What a budget gives over the box.

    retained: share of the independent cases in which he stays, spread evenly and laid out.
    worst: largest deviation in them, m, of both.    designed: of the layout in the two cases it is made for.
    """

    budget: float
    retained: tuple[Share, Share]
    worst: tuple[float, float]
    designed: float


def independent_cases(number: int, *, seed: int = SEED) -> list[Case]:
    """Cases of the uncertainty of the rollover, drawn by its laws."""
    space = load_study(str(files("studies.gunner.restraints") / "restraint_rollover.toml")).space
    table = space.quantile(np.random.default_rng(seed).random((number, space.dimension)))
    return [space.canonical(dict(zip(space.names, row, strict=True))) for row in table.tolist()]


def needed(
    budget: float, cases: Sequence[Case], *, evaluations: int = 8, model: GunnerRestraint | None = None
) -> Needed:
    """The even spread and the layout of a budget, in the same cases.

    model: with that budget of belts and airbags; None: of the rollover.
    """
    model = model or restraint(on="rollover", belts=budget, airbags=budget, step=STEP)
    even = np.full(model.members, budget / 180.0)
    found = optimise_layout(
        model.problem([{}, HEAVY]), max_evaluations=evaluations, multi_start=False, compare=False, probes=0
    )
    retained, worst = [], []
    for density in (even, found.density):
        runs = model.responses_of_cases(density, cases)
        made = [run for run in runs if not isinstance(run, Exception)]
        retained.append(counted_share(sum(run["ejected"] == 0.0 for run in made), len(runs)))
        worst.append(max(run["deviation"] for run in made))
    return Needed(
        budget=budget, retained=(retained[0], retained[1]), worst=(worst[0], worst[1]),
        designed=model.as_response(found.value),
    )  # fmt: skip


def lines(found: Needed) -> str:
    """A row of the table."""
    told = [
        f"{name} {share.hits} of {share.draws} retained ({100 * share.low:.0f} to {100 * share.high:.0f} %), "
        f"worst {worst:.3f} m"
        for name, share, worst in zip(("spread evenly", "laid out"), found.retained, found.worst, strict=True)
    ]
    return f"{found.budget:3g} belts and bags: {'; '.join(told)}, {found.designed:.3f} m in its two cases"


def main() -> None:
    """Print a row for each budget."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    budgets = [float(text) for text in sys.argv[2].split(",")] if len(sys.argv) > 2 else BUDGETS
    cases = independent_cases(number)
    for budget in budgets:
        print(lines(needed(budget, cases)), flush=True)


if __name__ == "__main__":
    main()

"""Scouts: an attack on a layout by runs at a longer step, whose worst cases are then run truly.

What breaks a layout may be one corner in hundreds, with nothing around it that is bad: no climb gets there,
and no more than many draws meet it. At a longer step a run costs about half, and ranks the cases as the
true one does. So a layout that has held so far is attacked by twice the runs of an attack, most of them
corners, at the step of the model's `coarsened`; the worst of what they met, far from each other, are the next
true runs of the adversary. Nothing is said of the scouts' own values. Where a study sends more, those beyond
twice the runs of an attack climb: where responses jump, what is worst may stand between corners, and few
draws come near.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import StudyError
from workbench.models.evaluator import Evaluator, Outcome
from workbench.robust_layout.cuts import spread_out_worst
from workbench.robust_layout.model import LayoutModel
from workbench.search.evidence.attack.adversary import Split, attack
from workbench.space.box import Space

__all__ = ["SCOUTS", "coarse_runs", "worst_of_scouts"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

SCOUTS = 2  # times the true runs of an attack, where the study does not say; beyond, they climb
CORNER, NEAR_CORNER = 0.7, 0.1  # of the scouts up to that number
TRIED = 16  # of the scouts' cases, far from each other, that are run truly
BATCH = 64  # runs between two looks at Ctrl-C


def coarse_runs(model: LayoutModel, *, threads: int) -> Callable[[Array], Evaluator] | None:
    """density -> evaluator of the model's runs at a longer step; None where it has none.

    What such a run raises is the outcome of that case; a call that raises is made again case by case.

    Raises (when it runs) StudyError: an answer is missing.
    """
    many: Any = getattr(model, "coarsened", None)
    if not callable(many):
        return None

    def of(density: Array) -> Evaluator:
        def evaluate(rows: Sequence[Case], *, purpose: str) -> list[Outcome]:
            found: list[Any] = []
            for begin in range(0, len(rows), BATCH):
                found += _answers(many, density, rows[begin : begin + BATCH], threads)
            return [_outcome(row, answer) for row, answer in zip(rows, found, strict=True)]

        return evaluate

    return of


def _answers(many: Any, density: Array, cases: Sequence[Case], threads: int) -> list[Any]:
    try:
        answers = list(many(density, cases, threads=threads))
    except Exception as error:  # a model may raise anything
        if len(cases) == 1:
            return [error]
        return [answer for case in cases for answer in _answers(many, density, [case], threads)]
    if len(answers) != len(cases):
        raise StudyError(
            f"coarsened of the layout model gave {len(answers)} answers for {len(cases)} cases; it needs "
            "responses or an error for each, in their order"
        )
    return answers


def _outcome(row: Case, answer: Any) -> Outcome:
    if isinstance(answer, Exception):
        return Outcome(parameters=row, status="failed", error=f"{type(answer).__name__}: {answer}")
    return Outcome(parameters=row, status="ok", outputs=answer)


def worst_of_scouts(
    evaluate: Evaluator,
    space: Space,
    *,
    response: str,
    limit: float,
    known: tuple[Case, float] | None,
    budget: int,
    attacked_by: int,
    seed: int,
) -> list[dict[str, Any]]:
    """The cases that `budget` scouts found worst, far from each other, to be run truly.

    evaluate: runs at a longer step.    known: the worst true run so far, where the first climbs begin.
    attacked_by: true runs of the attack that they go ahead of.
    """
    drawn = min(1.0, SCOUTS * attacked_by / budget)
    split = Split(interior=0.0, corner=CORNER * drawn, near_corner=NEAR_CORNER * drawn)
    made = attack(
        evaluate, space, value=limit, budget=budget, seed=seed, response=response, split=split,
        known=[] if known is None else [known],
    )  # fmt: skip
    outcomes = [attempt.outcome for attempt in made.attempts]
    found = spread_out_worst(space, outcomes, response=response, number=TRIED)
    return [space.canonical(outcome.parameters) for _, outcome in found]

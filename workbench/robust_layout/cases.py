"""Layouts for given cases: the engine's, made once and kept, and the trivial ones that it must beat."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.bound.binding import FEWEST, ByScenario
from workbench.engine.layout.formulation.even_spread import even_spread
from workbench.engine.layout.formulation.problem import FAILURES, LayoutProblem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.purify import purify
from workbench.robust_layout.document import check_gradient, finite, layout_document
from workbench.robust_layout.model import LayoutModel, layout_name, problem_of
from workbench.system.atomic import read_json, write_json

__all__ = [
    "GIVEN", "SAME", "TRIVIAL", "Optimised", "Search", "failing", "optimise_for_cases", "trivial_layouts",
]  # fmt: skip

Array = NDArray[np.float64]
Case = Mapping[str, Any]
Search = Literal["all cases", "binding cases", "several starts", "one start"]

GIVEN = "start as given"  # the start of the problem, judged as it is
TRIVIAL = ("none", "uniform", GIVEN, "nominal only")  # shown under these names whatever they are worth
SAME = 1e-6  # of the bounds' width: layouts that are no further apart are one to whoever builds them
MORE = 2  # times the evaluations, for a first search from another start


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimised:
    """A layout of the engine over some cases, and its `layout.json` content."""

    density: Array
    document: Mapping[str, Any]


def trivial_layouts(problem: LayoutProblem) -> dict[str, Array]:
    """uniform: every budget spread evenly; none; the start that the problem gives, where it is another."""
    found = {"uniform": even_spread(problem), "none": problem.lower.copy()}
    start, width = problem.into_budgets(problem.start), problem.upper - problem.lower
    if all(np.abs(start - other).max() > SAME * width.max() for other in found.values()):
        found[GIVEN] = start
    return found


def failing(model: LayoutModel, cases: Sequence[Case], start: Array | None) -> list[int]:
    """Which of these cases the optimiser cannot run on their own where it begins, at `start` or the problem's
    own; the last of them where it can run each."""
    found = []
    for k, case in enumerate(cases):
        try:
            problem = problem_of(model, [case])
            problem.checked(problem.into_budgets((problem.start if start is None else start).copy()))
        except FAILURES:
            found.append(k)
    return found or [len(cases) - 1]


def optimise_for_cases(
    model: LayoutModel,
    cases: Sequence[Case],
    *,
    start: Array | None,
    folder: Path,
    evaluations: int,
    identity: str,
    search: Search = "all cases",
) -> Optimised | str:
    """The engine's layout for these cases, made once and kept in `folder`; a sentence when there is none.

    search: with all cases at every step, or with those that bind; the latter with more evaluations from
        several starts beside the one that is given, or from that one. Few cases, and those that cannot be
        run alone, are searched all at once.
    """
    # by name: cases that an attack found come back from its file in another order of their parameters
    text = repr((identity, [sorted(case.items()) for case in cases], evaluations))
    text += "" if start is None else layout_name(start)
    text += "" if search == "all cases" else search
    place = folder / f"{blake2b(text.encode(), digest_size=8).hexdigest()}.json"
    document = read_json(place)
    if document is None:
        document = _optimise(model, cases, start, evaluations, search)
        folder.mkdir(parents=True, exist_ok=True)
        write_json(place, document)
    if "error" in document:
        return str(document["error"])
    return Optimised(density=np.array(document["density"]), document=document)


def _optimise(
    model: LayoutModel, cases: Sequence[Case], start: Array | None, evaluations: int, search: Search
) -> dict[str, Any]:
    try:
        problem = problem_of(model, cases)
        given = problem if start is None else replace(problem, start=problem.into_budgets(start.copy()))
        several, more = search == "several starts", search in ("several starts", "one start")
        if len(cases) < FEWEST or not isinstance(problem.evaluate, ByScenario):
            search, several, more = "all cases", False, False
        # the loop judges the trivial layouts itself, and looks from other starts
        result = optimise_layout(
            given, max_evaluations=MORE * evaluations if more else evaluations, compare=False, probes=0,
            multi_start=several or start is None, scenarios="all" if search == "all cases" else "binding",
        )  # fmt: skip
        clean = purify(problem, result.density) if problem.geometry is not None else None
    except FAILURES as error:
        return {"error": f"{type(error).__name__} in {len(cases)} cases, the last {dict(cases[-1])}: {error}"}
    history = [
        {
            "evaluation": h.evaluation, "value": finite(h.value), "best": finite(h.best),
            "active_peaks": h.active,
        }
        for h in result.history
        if h.start >= 0  # the trivial layouts stand beside the others, and would squeeze the figure
    ]  # fmt: skip
    return layout_document(
        problem, result, name=model.title, method="gsao", history=history, start_value=result.start_value,
        check=_gradient_of(model, cases[0]), clean=clean, baselines=({}, {}),
    )  # fmt: skip


def _gradient_of(model: LayoutModel, case: Case) -> Mapping[str, float]:
    """One case tells whether gradients are right; where it cannot be run at the problem's own start, as the
    search need not begin there, nothing does."""
    try:
        return check_gradient(model.problem([case]))
    except FAILURES:
        return {}

"""The stage `layout`: a problem named in a study file, optimised, purified, compared: `layout.json`.

The problem is a Python function "module:function" that returns a `LayoutProblem` of the engine, or a record
with system, objective, density and budget as the gallery's `studies.two_body.layout_problem` does. The run
keeps `layout.partial.json` up to date after every evaluation; interrupted, it goes on from the best design so
far.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.engine.layout.formulation.even_spread import even_spread
from workbench.engine.layout.formulation.problem import InvalidLayout, LayoutProblem
from workbench.engine.layout.optimise import METHODS, RUNS_ONLY, as_layout_problem, optimise_layout
from workbench.engine.layout.outcome.purify import purify
from workbench.engine.layout.outcome.result import HistoryEntry
from workbench.engine.layout.whole_members import whole_members
from workbench.errors import Interrupted, StudyError
from workbench.provenance.closure import digest_of_function
from workbench.report.lines.layout import layout_lines
from workbench.robust_layout.bill import layout_bill, write_bill
from workbench.robust_layout.document import check_gradient, finite, layout_document
from workbench.robust_layout.model import load_problem, refuse_empty_budgets
from workbench.stages.work import Work
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.system.atomic import read_json, write_json

__all__ = ["WORK", "run_layout"]

Array = NDArray[np.float64]
Progress = Callable[[HistoryEntry], None]

PARTIAL = "layout.partial.json"


def run_layout(
    folder: Path,
    *,
    problem: str | Any,
    options: Mapping[str, Any] | None = None,
    method: str = "gsao",
    evaluations: int = 50,
    tolerance: float = 1e-6,
    peaks: str = "all",
    purified: bool = True,
    whole: int | None = None,
    whole_evaluations: int = 300,
    whole_sizes: Sequence[float] = (),
    study_folder: Path | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Optimise a layout in a campaign's folder and write `layout.json`; returns the document.

    The bill of materials of a moving system stands beside it, as JSON and CSV.

    Args:
        problem: "module:function" or a problem itself.    options: keywords for the function.
        method, evaluations, tolerance, peaks: as in `optimise_layout`.
        purified: also look for a layout with few fractions.
        whole: also look for a layout of at most so many members, on or off.
        whole_evaluations: simulations for it.    whole_sizes: densities that its members may have.
        progress: called with every history entry.

    Raises StudyError for an unusable problem, Interrupted when the user stops it (run again to go on).
    """
    _check_method(method)
    name = problem if isinstance(problem, str) else type(problem).__name__
    loaded = load_problem(problem, options, folder=study_folder) if isinstance(problem, str) else problem
    try:
        full = as_layout_problem(loaded)
    except InvalidLayout as error:
        raise StudyError(f"layout problem '{name}': {error}") from error
    refuse_empty_budgets(full)
    kept = _Kept.opened(folder / PARTIAL, identity=_identity(name, options, method, full), problem=full)
    offset = len(kept.history)

    def keep(entry: HistoryEntry, density: Array) -> None:
        row = kept.add(entry, density, offset=offset)
        if progress is not None:
            progress(replace(entry, evaluation=row["evaluation"], best=kept.best))

    try:
        result = optimise_layout(
            replace(full, start=np.array(kept.density)), method, max_evaluations=max(1, evaluations - offset),
            tolerance=tolerance, peaks=peaks, progress=keep,  # type: ignore[arg-type]
        )  # fmt: skip
        check = check_gradient(full)
        clean = purify(full, result.density) if purified and full.geometry is not None else None
        found = (
            None if whole is None
            else whole_members(full, whole, evaluations=whole_evaluations, sizes=whole_sizes)
        )  # fmt: skip
    except KeyboardInterrupt:
        raise Interrupted(
            f"layout stopped after {len(kept.history)} evaluations, best value {kept.best:.6g}; "
            "run again to go on"
        ) from None
    except InvalidLayout as error:
        raise StudyError(f"layout problem '{name}': {error}") from error
    start_value = float(kept.history[0]["value"]) if offset else result.start_value
    document = layout_document(
        full, result, name=name, method=method, history=kept.history, start_value=start_value, check=check,
        clean=clean, baselines=_baselines(full), whole=found,
    )  # fmt: skip
    write_bill(folder, layout_bill(full, result.density))
    write_json(folder / "layout.json", document)
    (folder / PARTIAL).unlink(missing_ok=True)
    return document


@dataclass(slots=True, kw_only=True)
class _Kept:
    """What is kept of an optimisation, so that it can be gone on with: history and the best design so far."""

    path: Path
    identity: str
    history: list[dict[str, Any]]
    density: list[float]
    best: float

    @classmethod
    def opened(cls, path: Path, *, identity: str, problem: LayoutProblem) -> "_Kept":
        """What an interrupted run of the same problem left, or a beginning."""
        before = _resumable(path, identity, problem)
        history: list[dict[str, Any]] = list(before["history"]) if before else []
        density = before["density"] if before else problem.start.tolist()
        best = float(before["value"]) if before else np.inf
        return cls(path=path, identity=identity, history=history, density=density, best=best)

    def add(self, entry: HistoryEntry, density: Array, *, offset: int) -> dict[str, Any]:
        """One more evaluation, `offset` of which were made before the interruption; its row."""
        if entry.best < self.best or not self.history:
            self.best = min(self.best, entry.best)
            self.density = density.tolist()
        row = _entry(entry, offset, self.best)
        self.history.append(row)
        document = {"identity": self.identity, "history": self.history, "density": self.density}
        write_json(self.path, {**document, "value": finite(self.best)})
        return row


def _baselines(problem: LayoutProblem) -> tuple[dict[str, float], dict[str, float]]:
    """Values of the trivial layouts uniform, all and none: those within the budgets, and those beyond."""
    within: dict[str, float] = {}
    beyond: dict[str, float] = {}
    for name, density in (
        ("uniform", even_spread(problem)),
        ("all", problem.upper),
        ("none", problem.lower),
    ):
        try:
            value = float(np.max(problem.checked(density).values))
        except (InvalidLayout, ArithmeticError):
            continue  # without members the system may not hold together
        (within if problem.excess(density) <= 1e-9 else beyond)[name] = value
    return within, beyond


def _entry(entry: HistoryEntry, offset: int, best: float) -> dict[str, Any]:
    return {
        "evaluation": entry.evaluation + offset, "value": finite(entry.value), "best": finite(best),
        "active_peaks": entry.active, "budget": entry.budget, "kkt": finite(entry.kkt),
        "radius": finite(entry.radius), "start": entry.start, "accepted": entry.accepted,
    }  # fmt: skip


def _identity(name: str, options: Mapping[str, Any] | None, method: str, problem: LayoutProblem) -> str:
    digest = blake2b(digest_size=16)
    digest.update(repr((name, sorted((options or {}).items()), method)).encode())
    for array in (problem.lower, problem.upper, problem.costs, problem.limits):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _resumable(path: Path, identity: str, problem: LayoutProblem) -> dict[str, Any] | None:
    found = read_json(path)
    if not found or found.get("identity") != identity or len(found["density"]) != problem.members:
        return None
    return dict(found) if found.get("value") is not None else None


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """Optimise, for the worst case found when the table says `scenarios = true`."""
    keywords = dict(table)
    options = dict(keywords.pop("options", {}))
    if keywords.pop("scenarios", False):
        found = _worst_case(campaign, table)
        if found is None:
            raise StudyError(
                "[layout] scenarios = true needs a worst case; give the study a [worst_case] table"
            )
        options["scenarios"] = [found]
    campaign.progress.stage("layout", f"{table['problem']} by {table['method']}")
    return run_layout(campaign.folder, options=options, study_folder=campaign.study.folder, **keywords)


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> Iterable[str]:
    code = digest_of_function(table["problem"], campaign.study.folder)
    return [json.dumps([code, _worst_case(campaign, table)], sort_keys=True)]


def _worst_case(campaign: StoredRuns, table: Mapping[str, Any]) -> dict[str, Any] | None:
    """The parameters of the worst case found, when the table asks for it and it is there."""
    found = read_json(campaign.folder / "worst_case.json") if table.get("scenarios") else None
    return None if found is None else dict(found["parameters"])


def _check(study: Study) -> None:
    """The method is there, and the problem can be made, where it does not wait for a worst case."""
    table = study.layout or {}
    with placed(study.text, study.where, ("layout", "method")):
        _check_method(table["method"])
    if not table["scenarios"]:
        with placed(study.text, study.where, ("layout", "problem")):
            load_problem(table["problem"], table["options"], folder=study.folder)


def _check_method(method: str) -> None:
    known = (*METHODS, *RUNS_ONLY)
    if method not in known:
        raise StudyError(f"layout method needs to be one of {', '.join(known)}, got '{method}'")


WORK = Work(run=_run, inputs=_inputs, lines=layout_lines, check=_check)

"""The stage `layout`: a problem named in a study file, optimised, purified, compared, written as
`layout.json`.

The problem is a Python function "module:function" that returns a `LayoutProblem` of the engine, or a record
with system, objective, density and budget as the gallery's `studies.two_body.layout_problem` does. The run
keeps
`layout.partial.json` up to date after every evaluation; interrupted, it goes on from the best design so far.
"""

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.formulation.problem import InvalidLayout, LayoutProblem
from workbench.engine.layout.optimise import METHODS, as_layout_problem, optimise_layout
from workbench.engine.layout.outcome.purify import PurifiedLayout, fractional_members, purify
from workbench.engine.layout.outcome.result import HistoryEntry, LayoutResult
from workbench.errors import Interrupted, StudyError
from workbench.system.atomic import read_json, write_json

__all__ = ["check_gradient", "layout_document", "load_problem", "run_layout"]

Array = NDArray[np.float64]
Progress = Callable[[HistoryEntry], None]

_PARTIAL = "layout.partial.json"
_STEP = 1e-6  # of the bounds' width in the gradient check


def load_problem(
    reference: str, options: Mapping[str, Any] | None = None, *, folder: Path | None = None
) -> Any:
    """Call "module:function" with the options; modules beside the study file are found.

    Raises StudyError when the reference cannot be resolved or the function refuses its options.

    >>> load_problem("studies.trusses:cantilever").title
    'cantilever'
    """
    module_name, _, function_name = reference.partition(":")
    if not module_name or not function_name:
        raise StudyError(f"layout problem needs the form 'module:function', got '{reference}'")
    if folder is not None and str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        function = getattr(importlib.import_module(module_name), function_name)
    except ModuleNotFoundError as error:
        raise StudyError(
            f"layout problem '{reference}': no module '{error.name}'. "
            "Put it beside the study file or install it"
        ) from error
    except AttributeError as error:
        raise StudyError(f"layout problem '{reference}': module has no '{function_name}'") from error
    try:
        return function(**dict(options or {}))
    except (TypeError, ValueError) as error:
        raise StudyError(f"layout problem '{reference}' with {dict(options or {})}: {error}") from error


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
    study_folder: Path | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Optimise a layout in a campaign's folder and write `layout.json`; returns the document.

    Args:
        problem: "module:function" or a problem itself.    options: keywords for the function.
        method, evaluations, tolerance, peaks: as in `optimise_layout`.    purified: also look for few
        fractions. progress: called with every history entry.

    Raises StudyError for an unusable problem, Interrupted when the user stops it (run again to go on).
    """
    if method not in METHODS:
        raise StudyError(f"layout method needs to be one of {', '.join(METHODS)}, got '{method}'")
    name = problem if isinstance(problem, str) else type(problem).__name__
    loaded = load_problem(problem, options, folder=study_folder) if isinstance(problem, str) else problem
    try:
        full = as_layout_problem(loaded)
    except InvalidLayout as error:
        raise StudyError(f"layout problem '{name}': {error}") from error
    identity = _identity(name, options, method, full)
    before = _resumable(folder / _PARTIAL, identity, full)
    history: list[dict[str, Any]] = list(before["history"]) if before else []
    offset, start = len(history), np.array(before["density"]) if before else full.start
    best = float(before["value"]) if before else np.inf

    def keep(entry: HistoryEntry, density: Array) -> None:
        nonlocal best
        if entry.best < best or not history:
            best = min(best, entry.best)
            keep.density = density.tolist()  # type: ignore[attr-defined]
        row = _entry(entry, offset, best)
        history.append(row)
        write_json(
            folder / _PARTIAL,
            {"identity": identity, "history": history, "density": keep.density, "value": _finite(best)},  # type: ignore[attr-defined]
        )
        if progress is not None:
            progress(replace(entry, evaluation=row["evaluation"], best=best))

    keep.density = start.tolist()  # type: ignore[attr-defined]
    try:
        result = optimise_layout(
            replace(full, start=start), method, max_evaluations=max(1, evaluations - offset),
            tolerance=tolerance, peaks=peaks, progress=keep,  # type: ignore[arg-type]
        )  # fmt: skip
        check = check_gradient(full)
        clean = purify(full, result.density) if purified and full.geometry is not None else None
    except KeyboardInterrupt:
        raise Interrupted(
            f"layout stopped after {len(history)} evaluations, best value {best:.6g}; run again to go on"
        ) from None
    except InvalidLayout as error:
        raise StudyError(f"layout problem '{name}': {error}") from error
    start_value = float(before["history"][0]["value"]) if before else result.start_value
    document = layout_document(
        full, result, name=name, method=method, history=history, start_value=start_value, check=check,
        clean=clean, baselines=_baselines(full),
    )  # fmt: skip
    write_json(folder / "layout.json", document)
    (folder / _PARTIAL).unlink(missing_ok=True)
    return document


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
        "kkt": _finite(result.kkt),
        "evaluations": len(history),
        "shadow_prices": dict(zip(problem.names, result.shadow_prices.tolist(), strict=True)),
        "budgets": [
            {"name": budget, "limit": float(limit), "used": float(used)}
            for budget, limit, used in zip(
                problem.names, problem.limits, problem.costs @ result.density, strict=True
            )
        ],
        "density": result.density.tolist(),
        "grayness": result.grayness,
        "fractional": fractional_members(problem, result.density),
        "members": _members(problem, result.density),
        "history": history,
        "baselines": dict(baselines[0]),
        "beyond_budget": dict(baselines[1]),
        "purified": None if clean is None else {
            **{k: v for k, v in asdict(clean).items() if k != "density"},
            "density": clean.density.tolist(), "loss": clean.loss,
        },
        "gradient_check": dict(check),
        "verdicts": list(result.verdicts),
        "optima": list(result.optima),
    }  # fmt: skip


def check_gradient(problem: LayoutProblem, *, seed: int = 0) -> dict[str, float]:
    """Relative error of the gradient of the largest row along one random direction, by central
    differences."""
    rng = np.random.default_rng(seed)
    width = problem.upper - problem.lower
    density = np.clip(problem.start, problem.lower + 2 * _STEP * width, problem.upper - 2 * _STEP * width)
    direction = rng.standard_normal(problem.members) * width
    evaluation = problem.checked(density)
    row = int(np.argmax(evaluation.values))
    slope = float(problem.checked_gradients(evaluation, np.array([row]))[0] @ direction)
    largest = float(np.abs(direction / np.where(width > 0, width, 1.0)).max())
    h = _STEP / largest
    ahead, behind = (
        np.ravel(problem.checked(density + side * h * direction).values)[row] for side in (1.0, -1.0)
    )
    difference = float(ahead - behind) / (2 * h)
    return {"central difference": abs(slope - difference) / max(abs(slope), abs(difference), 1e-300)}


def _members(problem: LayoutProblem, density: Array) -> list[dict[str, Any]]:
    geometry = problem.geometry
    if geometry is None:
        return [{"name": f"{i}", "kind": "member", "density": float(a)} for i, a in enumerate(density)]
    return [
        {
            "name": f"{i}", "kind": geometry.kind[i], "density": float(a),
            "body_a": int(geometry.body_a[i]), "point_a": geometry.point_a[i].tolist(),
            "body_b": int(geometry.body_b[i]), "point_b": geometry.point_b[i].tolist(),
            "a": geometry.point_a[i].tolist(), "b": geometry.point_b[i].tolist(),
        }
        for i, a in enumerate(density)
    ]  # fmt: skip


def _baselines(problem: LayoutProblem) -> tuple[dict[str, float], dict[str, float]]:
    """Values of the trivial layouts uniform, all and none: those within the budgets, and those beyond."""
    width = problem.upper - problem.lower
    need, room = problem.costs @ width, problem.limits - problem.costs @ problem.lower
    share = min(1.0, float((room[need > 0] / need[need > 0]).min(initial=1.0)))
    within: dict[str, float] = {}
    beyond: dict[str, float] = {}
    for name, density in (
        ("uniform", problem.lower + share * width),
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
        "evaluation": entry.evaluation + offset, "value": entry.value, "best": _finite(best),
        "active_peaks": entry.active, "budget": entry.budget, "kkt": _finite(entry.kkt),
        "radius": _finite(entry.radius), "start": entry.start, "accepted": entry.accepted,
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


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

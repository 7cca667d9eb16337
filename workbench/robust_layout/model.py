"""A multibody model whose restraints may be laid out: what the robust loop asks of it, how workers run it.

    class MyModel:                                  # a planar one, a spatial one, or a bridge to another code
        title, response, unit, members
        def problem(self, scenarios): ...           # LayoutProblem of the engine over these uncertain cases
        def as_response(self, objective): ...       # what a value of the problem means as response
        def responses(self, density, uncertain): ...  # one true run: named responses

The loop knows nothing else of the model. `problem` may minimise any stand-in of the response (its square, a
norm); what counts and is reported are true runs by `responses`. Optional methods serve the report:
`motion(layouts, uncertain)` gives a `workbench.motion.frames.Motion` of named layouts in one case,
`outlines()` closed lines behind the drawing of the members, `places()` the layout matrix: names of its rows
and columns, and the (row, column) of every member. `refined(density, uncertain)` is the run at half the
step: a case that breaks a layout is believed when it breaks it there too. `responses_of_cases(density,
cases, threads=...)` gives the responses, or the error, of many cases in one call (`runs.py`).
"""

import importlib
import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.formulation.problem import FAILURES, LayoutProblem
from workbench.errors import StudyError
from workbench.models.protocol import ModelSpec
from workbench.system.atomic import read_json

__all__ = [
    "LAYOUT", "LayoutModel", "LayoutRun", "layout_name", "load_layout_model", "load_problem", "problem_of",
    "refuse_empty_budgets",
]  # fmt: skip

Array = NDArray[np.float64]

LAYOUT = "layout"  # the key beside the uncertain parameters that names the layout of a run
NEEDED = ("title", "response", "unit", "members", "problem", "as_response", "responses")

LIBRARIES = {"site-packages", "dist-packages", f"python{sys.version_info[0]}.{sys.version_info[1]}"}
"""Folders whose code is not the user's."""


class LayoutModel(Protocol):
    """Densities of candidate members (members,), each in [0, 1], in uncertain cases by name."""

    @property
    def title(self) -> str:
        """What is laid out, for reports."""

    @property
    def response(self) -> str:
        """The response whose worst case counts; smaller is better."""

    @property
    def unit(self) -> str:
        """Its unit."""

    @property
    def members(self) -> int:
        """Number of densities."""

    def problem(self, scenarios: Sequence[Mapping[str, Any]]) -> LayoutProblem:
        """Minimise the largest value over these cases, within the budgets."""

    def as_response(self, objective: float) -> float:
        """A value of the problem's objective in the response's terms; increasing, such as a root."""

    def responses(self, density: Array, uncertain: Mapping[str, Any]) -> Mapping[str, float]:
        """One true run."""


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
    told, given = f"layout problem '{reference}'", dict(options or {})
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        raise StudyError(
            f"{told}: no module '{error.name}'. Put it beside the study file or install it"
        ) from error
    except Exception as error:
        raise StudyError(f"{told}: importing {module_name} failed: {_told(error)}") from error
    function = getattr(module, function_name, None)
    if function is None:
        raise StudyError(f"{told}: module has no '{function_name}'")
    try:
        return function(**given)
    except StudyError:
        raise
    except Exception as error:
        raise StudyError(f"{told} with {given}: {_told(error)}") from error


def load_layout_model(
    reference: str, options: Mapping[str, Any] | None = None, *, folder: Path | None = None
) -> LayoutModel:
    """Call "module:function" with the options; modules beside the study file are found.

    Raises StudyError when it cannot be called, what it gives is no layout model, or that cannot say what it
    is.
    """
    model = load_problem(reference, options, folder=folder)
    missing = []
    for name in NEEDED:
        try:
            getattr(model, name)
        except Exception as error:
            if isinstance(error, AttributeError) and not hasattr(type(model), name):
                missing.append(name)
                continue
            raise StudyError(
                f"layout model '{reference}' with {dict(options or {})} does not give its {name}: "
                f"{_told(error)}"
            ) from error
    if missing:
        raise StudyError(
            f"layout model '{reference}' gives a {type(model).__name__} without {', '.join(missing)}; "
            f"it needs {', '.join(NEEDED)}"
        )
    return model  # type: ignore[no-any-return]


def problem_of(model: LayoutModel, cases: Sequence[Mapping[str, Any]]) -> LayoutProblem:
    """The model's problem over these cases.

    Raises what the engine says of cases that cannot be run, which is an answer of theirs, and StudyError for
    any other error, with the first case that has it alone and the line of the user's code.
    """
    try:
        problem = model.problem(cases)
    except (*FAILURES, StudyError):
        raise
    except Exception as error:
        for case in cases if len(cases) > 1 else ():
            problem_of(model, [case])
        told = f"of {len(cases)} cases" if len(cases) > 1 else f"of the case {dict(cases[0])}"
        raise StudyError(
            f"the layout model '{model.title}' makes no problem {told}: {_told(error)}"
        ) from error
    if model.members not in (problem.members, problem.densities):
        raise StudyError(
            f"the layout model '{model.title}' says that it has {model.members} members, its problem has "
            f"{problem.densities}"
        )
    refuse_empty_budgets(problem)
    return problem


def refuse_empty_budgets(problem: LayoutProblem) -> None:
    """Raises StudyError for a budget that counts no member, as of a misspelt kind: it would leave the members
    that it is meant for without any limit."""
    for name, costs in zip(problem.names, problem.costs, strict=True):
        if not costs.any():
            raise StudyError(
                f"the budget '{name}' of '{problem.title}' counts no member: all of its costs are 0"
            )


def _told(error: Exception) -> str:
    """An error of the user's code: its kind, its words, and the line of theirs that it came from."""
    said = f"{type(error).__name__}: {error}"
    own = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename != __file__ and not LIBRARIES.intersection(Path(frame.filename).parts)
        and not frame.filename.startswith("<")
    ]  # fmt: skip
    if not own:
        return said
    return f"{said} ({Path(own[-1].filename).name}, line {own[-1].lineno}, in {own[-1].name})"


def layout_name(density: Array) -> str:
    """The name of a layout: a digest of its densities.

    >>> layout_name(np.zeros(3)) == layout_name(np.ones(3))
    False
    """
    return blake2b(np.ascontiguousarray(density, dtype="<f8").tobytes(), digest_size=8).hexdigest()


@dataclass(slots=True)
class LayoutRun:
    """Runs a layout model on rows that hold the uncertain parameters and the name of a layout.

    Densities stand in `<options["layouts"]>/<name>.json`, so that a worker serves all layouts of a study.
    """

    model: LayoutModel
    folder: Path
    _known: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def opened(cls, spec: ModelSpec) -> "LayoutRun":
        """Make the model once per worker."""
        model = load_layout_model(spec.options["model"], spec.options["options"], folder=Path(spec.folder))
        return cls(model, Path(spec.options["layouts"]))

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> Any:
        """One true run of the named layout."""
        density = self.density(str(row[LAYOUT]))
        return self.model.responses(density, {k: v for k, v in row.items() if k != LAYOUT})

    def density(self, name: str) -> Array:
        """(members,) densities of the named layout."""
        if name not in self._known:
            self._known[name] = np.array(read_json(self.folder / f"{name}.json")["density"], dtype=float)
        return self._known[name]

    def close(self) -> None:
        """Nothing to release."""

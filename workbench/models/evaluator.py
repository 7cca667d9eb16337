"""What a search asks of a model: rows of named parameters in, one outcome each out, failures as data.

A search never calls a model itself. It hands rows to an `Evaluator`; the campaign's evaluator stores every
run and answers a row it has already run from the store, so an interrupted search continues by asking again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

from workbench.errors import StudyError
from workbench.models.gradients import parted
from workbench.models.values import why_no_values

__all__ = [
    "Evaluator",
    "FunctionEvaluator",
    "Outcome",
    "Reading",
    "RepeatingEvaluator",
    "evaluator_of",
    "need_function",
    "response_name",
    "response_reader",
]

Reading = Callable[[Mapping[str, float]], float]


def need_function(given: Any, *, takes: str) -> None:
    """Refuse a model that cannot be called, before it becomes so many failed runs.

    Raises: StudyError.
    """
    if not callable(given):
        raise StudyError(f"function needs a function that takes {takes}, got {given!r:.60}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One true run. `outputs` is empty unless `status` is "ok"."""

    parameters: Mapping[str, Any]
    status: str  # ok | failed | timeout | killed | nonfinite
    outputs: Mapping[str, float] = field(default_factory=dict)
    # response -> parameter -> derivative, where the model offers them: unit of the response per unit of the
    # parameter
    gradients: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    key: str = ""  # the run's key in the store, or its running number
    error: str = ""


class Evaluator(Protocol):
    """Runs rows; the answers come in the order of the rows, whatever the order of completion."""

    def __call__(self, rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        """One outcome per row; equal rows are run once."""


class RepeatingEvaluator(Evaluator, Protocol):
    """An evaluator that can run a row again, which a model with noise answers otherwise."""

    def __call__(self, rows: Sequence[Mapping[str, Any]], *, purpose: str, repeat: int = 0) -> list[Outcome]:
        """One outcome per row; `repeat` k > 0 asks for the k-th further run of each."""


Given = TypeVar("Given", bound=Evaluator)


@dataclass(slots=True)
class FunctionEvaluator:
    """Calls a plain function in this process; equal rows of one `repeat` are run once.

    The function takes the parameters by name and returns a float or a mapping of response name to float.
    A model with gradients returns a pair: that, and the derivatives by parameter (of a float) or by response
    and parameter (of a mapping).
    """

    function: Callable[..., Any]
    _seen: dict[tuple[Any, ...], Outcome] = field(default_factory=dict)

    def __post_init__(self) -> None:
        need_function(self.function, takes="the parameters by name")

    def __call__(self, rows: Sequence[Mapping[str, Any]], *, purpose: str, repeat: int = 0) -> list[Outcome]:
        """One outcome per row."""
        return [self._one(row, repeat) for row in rows]

    def _one(self, row: Mapping[str, Any], repeat: int) -> Outcome:
        address = (repeat, *sorted(row.items()))
        if address not in self._seen:
            self._seen[address] = self._run(row, key=f"run {len(self._seen) + 1}")
        return self._seen[address]

    def _run(self, row: Mapping[str, Any], *, key: str) -> Outcome:
        try:
            answer, slopes = parted(self.function(**row))
        except Exception as exc:  # a model may raise anything; the run becomes data
            return Outcome(parameters=row, status="failed", key=key, error=f"{type(exc).__name__}: {exc}")
        slopes = slopes or {}
        if not isinstance(answer, Mapping):
            answer, slopes = {"y": answer}, {"y": slopes} if slopes else {}
        try:
            outputs = {name: float(value) for name, value in answer.items()}
            gradients = {r: {p: float(g) for p, g in by.items()} for r, by in slopes.items()}
        except (AttributeError, TypeError, ValueError) as exc:
            text = (
                f"the model returned {answer!r}; a number or a mapping of names to numbers is needed ({exc})"
            )
            return Outcome(parameters=row, status="failed", key=key, error=text)
        if wrong := why_no_values(outputs):
            return Outcome(parameters=row, status="nonfinite", key=key, error=wrong)
        return Outcome(parameters=row, status="ok", outputs=outputs, gradients=gradients, key=key)


def evaluator_of(function: Callable[..., Any] | None, evaluator: Given | None) -> "Given | FunctionEvaluator":
    """The evaluator that was given, or one that calls the function in this process.

    Raises:
        StudyError: neither came.
    """
    if evaluator is not None:
        return evaluator
    if function is None:
        raise StudyError(
            "a search needs a function, or an evaluator that runs rows in its place; got neither"
        )
    return FunctionEvaluator(function)


def response_name(response: str | Reading | None) -> str:
    """How the searched number is called in documents."""
    return response if isinstance(response, str) else "y" if response is None else "combination"


def response_reader(response: str | Reading | None) -> Reading:
    """How to read the searched number off a run's outputs.

    `response` is a name, a function of the mapping of outputs (a weighted or constrained combination), or
    None when the model has one response only.
    """
    if callable(response):
        return response

    def read(outputs: Mapping[str, float]) -> float:
        if response is None:
            if len(outputs) != 1:
                raise StudyError(
                    f"the model returns {sorted(outputs)}; say which with response=, "
                    "or give a function of the mapping"
                )
            return next(iter(outputs.values()))
        if response not in outputs:
            raise StudyError(f"response {response!r} is not among the model's outputs {sorted(outputs)}")
        return outputs[response]

    return read

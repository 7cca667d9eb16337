"""The runs of a search, and the runs that a search is given: of another search, of a table, of the store."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING, Any, TypeAlias

from workbench.errors import StudyError
from workbench.models.evaluator import Outcome, Reading
from workbench.models.stored.evaluation import Evaluation
from workbench.models.values import is_value, why_no_values
from workbench.space.box import Space

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Run", "Start", "given_outcomes", "given_rows"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run of a search. `value` is None when the run failed; `predicted` and `std` are what the Kriging
    expected before the run, None for given runs and the start design. `outputs` holds all responses of the
    run, `error` what a failed one said. `smoothed`: where runs have noise, what the
    Kriging of all runs holds for the mean at this point."""

    key: str
    number: int  # 1, 2, ... within the search; 0 for a run that was given
    proposal: str
    parameters: Mapping[str, Any]
    status: str
    value: float | None
    predicted: float | None = None
    std: float | None = None
    outputs: Mapping[str, float] = field(default_factory=dict)
    error: str = ""
    smoothed: float | None = None


Start: TypeAlias = "Sequence[Outcome | Evaluation | Run | Mapping[str, Any]] | pd.DataFrame"


def given_outcomes(start: Any, space: Space, *, response: str | Reading | None) -> list[Outcome]:
    """Runs given as outcomes, as the `runs` of another search, as rows or as a table of parameters and
    responses.

    Raises:
        StudyError: a row is none of these, or holds no number where the searched response should stand.
    """
    return [_given(run, f"row {i + 1} of start", space, response) for i, run in enumerate(given_rows(start))]


def given_rows(start: Any) -> list[Any]:
    """The runs one by one, of a table its rows.

    Raises:
        StudyError: it is no sequence and no table.
    """
    if hasattr(start, "columns") and hasattr(start, "to_dict"):
        rows: list[Any] = start.to_dict("records")
        return rows
    if isinstance(start, str) or not isinstance(start, Sequence):
        raise StudyError(
            f"start needs a sequence of runs or a table, got {type(start).__name__}. "
            "Give result.runs of another search, rows as mappings, or a DataFrame"
        )
    return list(start)


def _given(run: Any, place: str, space: Space, response: str | Reading | None) -> Outcome:
    if isinstance(run, Outcome):
        return run
    if isinstance(run, Evaluation):
        return run.as_outcome()
    if isinstance(run, Run):
        return _of_run(run, place, response)
    if isinstance(run, Mapping):
        return _of_row(run, place, space, response)
    raise StudyError(
        f"{place} needs a mapping of parameters and responses, an outcome or a run of another search, "
        f"got {run!r:.100}"
    )


def _of_run(run: Run, place: str, response: str | Reading | None) -> Outcome:
    """The outcome behind a run of another search, which may have read another response off it."""
    outputs = dict(run.outputs)
    if not outputs and run.value is not None:
        if callable(response):
            raise StudyError(f"{place} holds no outputs to read a combination of responses from")
        outputs = {response or "y": run.value}
    # numbers of runs begin at one in every search
    key = f"given {run.key}" if run.key.startswith("run ") else run.key
    return Outcome(
        parameters=run.parameters,
        status="ok" if outputs else run.status,
        outputs=outputs,
        key=key,
        error=run.error,
    )


def _of_row(row: Mapping[str, Any], place: str, space: Space, response: str | Reading | None) -> Outcome:
    """A run given as one mapping; columns of text beside the searched response are left aside."""
    parameters = {name: value for name, value in row.items() if name in space.names}
    columns = {name: value for name, value in row.items() if name not in space.names}
    if isinstance(response, str) and response not in columns:
        raise StudyError(f"{place} has no {response!r}; beside the parameters it has {sorted(columns)}")
    if not columns:
        raise StudyError(f"{place} holds no response beside its parameters {sorted(parameters)}")
    outputs: dict[str, float] = {}
    for name, value in columns.items():
        try:
            outputs[name] = nan if value is None else float(value)
        except (TypeError, ValueError):
            if name == response or response is None:
                raise StudyError(
                    f"{place} has {name} = {value!r:.60}, but a response is a number. Leave the column out, "
                    "or say which one is searched with response="
                ) from None
    if isinstance(response, str):
        outputs = {name: value for name, value in outputs.items() if name == response or is_value(value)}
    wrong = why_no_values(outputs)
    usable = bool(outputs) and not wrong
    return Outcome(
        parameters=parameters,
        status="ok" if usable else "nonfinite",
        outputs=outputs if usable else {},
        error=wrong,
    )

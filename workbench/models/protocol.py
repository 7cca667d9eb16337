"""Models behind one protocol: a row of named parameters in, named responses out, failures as data.

A model is described by a `ModelSpec` of plain types, so that it can be sent to a worker process or a cluster
as JSON and opened there (see `opening.py`). `call` runs an opened model on one row and never raises: whatever
the model does, short of taking the process down, becomes an `Answer`.
"""

import math
import time
import traceback
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, SupportsFloat

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.gradients import checked_gradients, parted
from workbench.models.histories import History, Reduction
from workbench.models.values import why_no_values
from workbench.system.processes.interrupts import signals_noted
from workbench.system.processes.processor_time import processor_time

__all__ = ["Answer", "Model", "ModelSpec", "call", "settle", "told_answer"]

LONGEST_ERROR = 4000  # characters of a message that are kept
MOST_KEPT = 200  # numbers beside the responses of a run


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """One evaluation as it ended: ok, failed, timeout, killed, nonfinite or skipped.

    `gradients`: response -> parameter -> derivative, where the model gives them.
    `kept`: finite numbers that the model returned beside its responses, from which others may be read later;
    a number returned without a name stands under "". `wall`, `cpu`: s, with the children that the run waited
    for. `host`: where it was made, when that is known.
    """

    status: str
    outputs: Mapping[str, float] = field(default_factory=dict)
    gradients: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    histories: Mapping[str, History] = field(default_factory=dict)
    kept: Mapping[str, float] = field(default_factory=dict)
    error: str = ""
    log: str = ""
    wall: float = 0.0
    cpu: float = 0.0
    host: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelSpec:
    """What to run, in plain types: `kind`, the options of that kind, the study's folder, names, responses.

    `responses` maps each response's name to its reduction (None: a number), `identity` and `version` enter
    the key of every run. `places` says where in the study file a key of the model stands, such as
    "study.toml, line 7".
    """

    kind: str
    options: Mapping[str, Any]
    folder: str
    names: tuple[str, ...]
    responses: Mapping[str, Reduction | None]
    identity: str
    version: str
    places: Mapping[str, str] = field(default_factory=dict)

    @contextmanager
    def placed(self, key: str) -> Iterator[None]:
        """Put file and line of a key, such as "function", in front of a StudyError raised inside."""
        try:
            yield
        except StudyError as exc:
            if key not in self.places:
                raise
            raise StudyError(f"{self.places[key]}: {exc}") from exc.__cause__

    def to_dict(self) -> dict[str, Any]:
        """Plain types for JSON; `ModelSpec.from_dict` takes them back."""
        reductions = {
            name: None if r is None else {"kind": r.kind, "at": r.at, "p": r.p}
            for name, r in self.responses.items()
        }
        return {
            "kind": self.kind,
            "options": dict(self.options),
            "folder": self.folder,
            "names": list(self.names),
            "responses": reductions,
            "identity": self.identity,
            "version": self.version,
            "places": dict(self.places),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "ModelSpec":
        """The description of a mapping as `to_dict` writes it."""
        reductions = {name: None if r is None else Reduction(**r) for name, r in data["responses"].items()}
        return cls(**{**data, "names": tuple(data["names"]), "responses": reductions})


class Model(Protocol):
    """An opened model. `run` may raise anything; `call` turns that into an answer."""

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> Any:
        """A number, a mapping of response names to numbers or histories, or an `Answer`."""

    def close(self) -> None:
        """Release what the model holds."""


def call(model: Model, spec: ModelSpec, row: Mapping[str, Any], *, workdir: Path | None = None) -> Answer:
    """Run the model on one row; every way to fail becomes an `Answer`. Ctrl-C passes through."""
    wall, cpu = time.perf_counter(), processor_time()
    with signals_noted() as may_be_stopped:
        try:
            raw = model.run(row, workdir)
            answer = raw if isinstance(raw, Answer) else _settled(raw, spec)
        except EvaluationFailed as exc:
            answer = Answer(status="failed", error=str(exc)[:LONGEST_ERROR])
        except MemoryError:
            answer = Answer(status="failed", error="MemoryError: the model ran out of memory")
        except (Exception, SystemExit, KeyboardInterrupt) as exc:  # a model may raise anything
            if isinstance(exc, KeyboardInterrupt) and may_be_stopped():
                raise
            text = ": ".join(filter(None, (type(exc).__name__, str(exc))))[:LONGEST_ERROR]
            trace = "".join(traceback.format_exception(exc)[-6:])
            answer = Answer(status="failed", error=text, log=trace[-LONGEST_ERROR:])
    return replace(answer, wall=time.perf_counter() - wall, cpu=answer.cpu or processor_time() - cpu)


def _settled(raw: Any, spec: ModelSpec) -> Answer:
    """The answer with its gradients, where the model returned a pair; those never cost a run its values."""
    values, slopes = parted(raw)
    try:
        answer = settle(values, spec.responses, keep=spec.options.get("keep", ()))
    except EvaluationFailed as exc:  # the model gave something: responses declared later may be in it
        return Answer(status="failed", error=str(exc)[:LONGEST_ERROR], kept=_numbers(values))
    if slopes is None or answer.status != "ok":
        return answer
    try:
        return replace(answer, gradients=checked_gradients(slopes, spec.names, tuple(spec.responses)))
    except EvaluationFailed as exc:
        return replace(answer, error=f"no gradient: {exc}"[:LONGEST_ERROR])


def settle(raw: Any, responses: Mapping[str, Reduction | None], *, keep: Collection[str] = ()) -> Answer:
    """The answer in what a model returned: declared responses as floats, histories reduced.

    One that is not finite, or too large to be modelled, makes the run a failed one.

    Other finite numbers are kept beside them, and the histories named in `keep`.

    Raises:
        EvaluationFailed: a response is missing, is no number, or is a history without a reduction.
    """
    kept = _numbers(raw)
    if not isinstance(raw, Mapping):
        if len(responses) != 1:
            names = ", ".join(responses)
            raise EvaluationFailed(f"the model returned {_short(raw)}; a mapping with {names} is needed")
        raw = {next(iter(responses)): raw}
    outputs: dict[str, float] = {}
    histories: dict[str, History] = {}
    for name, reduction in responses.items():
        if name not in raw:
            came = ", ".join(map(str, list(raw)[:20])) or "an empty mapping"
            raise EvaluationFailed(f"the model returned no {name!r}, it returned {came}")
        value = raw[name]
        if reduction is not None:
            histories[name] = _history(name, value)
            outputs[name] = reduction.of(histories[name])
        else:
            outputs[name] = _number(name, value)
    for name in keep:
        if name not in responses and name in raw and name not in kept:
            histories[name] = _history(name, raw[name])
    if wrong := why_no_values(outputs):
        return Answer(status="nonfinite", histories=histories, kept=kept, error=wrong)
    beside = {name: value for name, value in kept.items() if name not in outputs}
    return Answer(status="ok", outputs=outputs, histories=histories, kept=beside)


def told_answer(
    outputs: Mapping[str, Any] | float | None, failure: str | None, reductions: Mapping[str, Reduction | None]
) -> Answer:
    """The answer that somebody tells: `outputs`, or the `failure` that kept a run from giving any.

    Raises:
        StudyError: neither.
    """
    if failure is not None:
        return Answer(status="failed", error=failure)
    if outputs is None:
        raise StudyError("tell needs outputs, or the failure that kept the run from giving any")
    try:
        return settle(outputs, reductions)
    except EvaluationFailed as exc:
        return Answer(status="failed", error=str(exc))


def _numbers(raw: Any) -> dict[str, float]:
    """The finite numbers among what a model returned, MOST_KEPT at most."""
    given = raw if isinstance(raw, Mapping) else {"": raw}
    found: dict[str, float] = {}
    for name, value in given.items():
        if (
            not isinstance(name, str)
            or not isinstance(value, SupportsFloat)
            or len(getattr(value, "shape", "")) > 0
        ):
            continue
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            continue
        if math.isfinite(number) and len(found) < MOST_KEPT:
            found[name] = number
    return found


def _number(name: str, value: Any) -> float:
    shape = getattr(value, "shape", ())
    if value is None or isinstance(value, str | bytes | complex | Mapping) or shape != ():
        raise EvaluationFailed(
            f"response {name!r} came as {_short(value)}; a number is needed (a history needs reduce)"
        )
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise EvaluationFailed(f"response {name!r} came as {_short(value)}; a number is needed") from None


def _history(name: str, value: Any) -> History:
    try:
        time_, values = (value.time, value.values) if isinstance(value, History) else value
        return History.of(time_, values)
    except (TypeError, ValueError):
        raise EvaluationFailed(
            f"response {name!r} came as {_short(value)}; a pair (time, values) is needed"
        ) from None


def _short(value: Any) -> str:
    """What came, on one line: a report groups failures by it, and shows the first line alone."""
    shape = getattr(value, "shape", ())
    if isinstance(shape, tuple) and shape != ():
        return f"an array of shape {shape}"  # its numbers differ from run to run
    try:
        text = " ".join(repr(value).split())
    except Exception:
        text = f"an object of type {type(value).__name__}"
    return text if len(text) < 200 else f"{text[:200]}..."

"""From what pydantic refuses to what a person reads: file, line, key path, what was expected, what came."""

import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Any

from workbench.errors import StudyError
from workbench.study.expectations import expected
from workbench.study.toml_lines import find_line

__all__ = ["key_path", "placed", "validated"]

MOST_ERRORS = 10

# what other programs call a key -> what it is called here, in whichever table
ELSEWHERE = {
    "min": ("lower",),
    "max": ("upper",),
    "lower_bound": ("lower",),
    "upper_bound": ("upper",),
    "bounds": ("lower",),
    "nominal": ("baseline",),
    "initial_point": ("baseline",),
    "descriptor": ("name",),
    "marginal": ("distribution",),
    "samples": ("runs",),
    "n": ("runs",),
    "size": ("runs",),
    "max_function_evaluations": ("budget",),
    "max_iterations": ("budget",),
    "evaluations": ("budget",),
    "concurrency": ("workers",),
    "evaluation_concurrency": ("workers",),
    "cores": ("workers",),
    "driver": ("command",),
    "analysis_drivers": ("command",),
}


@contextmanager
def placed(text: str, where: str, path: Sequence[str | int]) -> Iterator[None]:
    """Put file and line of the key at `path` in front of a StudyError raised inside."""
    try:
        yield
    except StudyError as exc:
        line = find_line(text, path)
        raise StudyError(f"{where}{'' if line is None else f', line {line}'}: {exc}") from None


def validated(data: Mapping[str, Any], text: str, where: str) -> Any:
    """The file's content as a `StudySchema`, or a StudyError with a line for every refusal."""
    from pydantic import ValidationError

    from workbench.study.schema import StudySchema

    try:
        return StudySchema.model_validate(data)
    except ValidationError as exc:
        needs: dict[tuple[str, str], dict[str, str]] = {}
        for error in exc.errors(include_url=False, include_context=True):
            path = _path_in_file(error["loc"], data)
            of_kind = error["type"].startswith("union_tag")
            line = find_line(text, (*path, "kind") if of_kind else path)
            place = where if line is None else f"{where}, line {line}"
            begin, need, end = _words(error, path)
            needs.setdefault((f"{place}: {begin}", end), {})[need] = error["type"]
        lines = [f"{begin}{_alternatives(words)}{end}" for (begin, end), words in needs.items()]
        raise StudyError("\n".join(lines[:MOST_ERRORS])) from None
    except RecursionError:
        raise StudyError(f"{where} is nested too deeply") from None


def _alternatives(needs: Mapping[str, str]) -> str:
    """What one value had to be, by the types of the errors: text or a number.

    Where it is of one of the types wanted and refused for another reason, only that is said.
    """
    of_type = [need for need, kind in needs.items() if not kind.endswith("_type")]
    return " or ".join(of_type or needs)


def _path_in_file(loc: Sequence[str | int], data: Mapping[str, Any]) -> tuple[str | int, ...]:
    """The location without pydantic's own steps (union tags), as far as it exists in the file."""
    if loc[:1] == ("model",):
        loc = (loc[0], *loc[2:])  # the kind, which a table may also have as a key
    path: list[str | int] = []
    here: Any = data
    for k, step in enumerate(loc):
        last = k == len(loc) - 1
        if isinstance(here, dict) and step in here:
            here = here[step]
            path.append(step)
        elif isinstance(here, list) and isinstance(step, int) and step < len(here):
            here = here[step]
            path.append(step)
        elif last and isinstance(here, dict) and isinstance(step, str):
            path.append(step)  # a key that is missing
    return tuple(path)


def _words(error: Mapping[str, Any], path: Sequence[str | int]) -> tuple[str, str, str]:
    """A refusal in three parts: what is refused, what was expected, and what came."""
    name = key_path(path)
    given = error.get("input")
    kind = error["type"]
    if kind == "extra_forbidden":
        known = _known_keys(path[:-1], error["loc"])
        close = [key for key in ELSEWHERE.get(str(path[-1]).lower(), ()) if key in known]
        close = close or get_close_matches(str(path[-1]), known, n=1)
        hint = f"Did you mean {close[0]!r}?" if close else f"Known keys here: {', '.join(known)}"
        return f"unknown key {name}. {hint}", "", ""
    if kind == "missing":
        return f"{name} is missing", "", ""
    if kind == "union_tag_not_found":
        return f"{name}.kind is missing; it is one of {_tags()}", "", ""
    if kind == "union_tag_invalid":
        return f"{name}.kind is one of {_tags()}, got {error['ctx']['tag']!r}", "", ""
    shown = repr(given)
    return f"{name} needs ", expected(error), f", got {shown if len(shown) < 80 else shown[:77] + '...'}"


def key_path(path: Sequence[str | int]) -> str:
    """A key as a person writes it.

    >>> key_path(("parameter", 1, "lower"))
    'parameter[2].lower'
    """
    out = ""
    for step in path:
        out += f"[{step + 1}]" if isinstance(step, int) else f".{step}" if out else step
    return out


def _tags() -> str:
    return ", ".join(tag for tag, _ in _model_tables())


def _model_tables() -> list[tuple[str, Any]]:
    from workbench.study.schema import StudySchema

    classes = typing.get_args(StudySchema.model_fields["model"].annotation)
    return [(typing.get_args(c.model_fields["kind"].annotation)[0], c) for c in classes]


def _known_keys(path: Sequence[str | int], loc: Sequence[str | int]) -> list[str]:
    """The keys that the table at `path` may hold."""
    from workbench.study.schema import StudySchema

    here: Any = StudySchema
    for step in path:
        if isinstance(step, int):
            continue
        if step == "model" and here is StudySchema:
            here = dict(_model_tables()).get(str(loc[1]))
        elif here is not None and step in here.model_fields:
            here = _table_class(here.model_fields[step].annotation)
        else:
            return []
    return [f.alias or name for name, f in here.model_fields.items()] if here is not None else []


def _table_class(annotation: Any) -> Any:
    """The pydantic class inside list[...] or ... | None."""
    if hasattr(annotation, "model_fields"):
        return annotation
    if typing.get_origin(annotation) in (list, typing.Union, types.UnionType, typing.Annotated):
        return next((c for a in typing.get_args(annotation) if (c := _table_class(a)) is not None), None)
    return None

"""From a study file to its record: one typed TOML file, read and checked.

Every refusal is a `StudyError` that names the file, the line, the key path, what was expected and what came.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.histories import Reduction
from workbench.models.readers import checked_rule
from workbench.sampling.kinds import DesignOptions, check_kind, checked_up_to
from workbench.space.box import Parameter, Response, Space
from workbench.space.groups import check_selection, chosen
from workbench.study.messages import placed, validated
from workbench.study.record import TABLES, Study
from workbench.study.robust_table import check_robust
from workbench.study.toml_lines import cure_of_line
from workbench.study.worst_case_targets import CHECKS

__all__ = ["Study", "json_schema", "load_study", "parse_study"]

OPTIONS = tuple(option.name for option in fields(DesignOptions))
LARGEST_FILE = 5_000_000  # bytes; a study file is written by a person


def load_study(path: str | Path) -> Study:
    """Read a study file.

    Raises:
        StudyError: it does not exist, is not TOML, or a key or value in it is refused.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise StudyError(f"{path} is a folder; give a study file such as study.toml")
        if path.stat().st_size > LARGEST_FILE:
            raise StudyError(
                f"{path} has {path.stat().st_size} bytes; a study file has at most {LARGEST_FILE}"
            )
        text = path.read_bytes().decode("utf-8")
    except StudyError:
        raise
    except FileNotFoundError:
        raise StudyError(f"no study file {path}{_near(path)}") from None
    except UnicodeDecodeError as exc:
        raise StudyError(f"{path} is not text in UTF-8 (byte {exc.start})") from None
    except (OSError, ValueError) as exc:
        raise StudyError(f"cannot read {path}: {exc}") from None
    return parse_study(text, path=path)


def parse_study(text: str, *, path: Path | None = None) -> Study:
    """The study written in `text`; `path` is for messages and relative file names."""
    where = path.name if path is not None else "study"
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as exc:
        raise StudyError(f"{where} is not TOML: {exc}{cure_of_line(text, str(exc))}") from None
    except (RecursionError, ValueError, OverflowError, MemoryError):
        raise StudyError(
            f"{where} is not TOML that can be read: nested too deeply or a number out of range"
        ) from None
    schema = validated(data, text, where)
    return _study(schema, text, path, where)


def json_schema() -> dict[str, Any]:
    """The JSON schema of a study file, for completion in editors."""
    from workbench.study.schema import StudySchema

    return StudySchema.model_json_schema()


def _study(schema: Any, text: str, path: Path | None, where: str) -> Study:
    """The record of a validated file; what single types cannot tell is checked at the line it stands on."""
    space = _space(schema, text, where)
    responses, reductions, reads = [], {}, {}
    for k, table in enumerate(schema.response):
        with placed(text, where, ("response", k)):
            names = None if table.regimes is None else (table.regimes[0], table.regimes[1])
            responses.append(Response(table.name, table.unit, label=table.label, regimes=names))
            if table.name in reductions or table.name in space.names:
                raise StudyError(f"response {table.name!r} is given twice or has the name of a parameter")
            reductions[table.name] = _reduction(table)
            if (table.read is not None) != (schema.model.kind == "command"):
                raise StudyError(
                    f"response {table.name!r}: read goes with model kind 'command', which needs it"
                )
            if table.read is not None:
                reads[table.name] = checked_rule(
                    table.name, table.read.model_dump(), reduced=table.reduce is not None
                )
    dumped = schema.model_dump(by_alias=True)
    if dumped["worst_case"] is not None and dumped["worst_case"]["responses"] is None:
        dumped["worst_case"]["sense"] = dumped["worst_case"]["sense"] or "max"
    study = Study(
        name=schema.study.name,
        seed=schema.study.seed,
        title=schema.study.title,
        space=space,
        responses=tuple(responses),
        reductions=reductions,
        reads=reads,
        path=path,
        text=text,
        **{name: _without_none(dumped[name]) for name in TABLES},
    )
    _check_names(study, text, where)
    _check_design(study, text, where)
    _check_stages(study, text, where)
    return study


def _space(schema: Any, text: str, where: str) -> Space:
    parameters = []
    for k, table in enumerate(schema.parameter):
        given = {key: value for key, value in table.model_dump().items() if value is not None}
        apart = "baseline" in given and "factor" not in given  # so that its refusal stands at its own line
        with placed(text, where, ("parameter", k)):
            baseline = given.pop("baseline") if apart else None
            parameter = Parameter.from_dict(given)
        with placed(text, where, ("parameter", k, "baseline")):
            parameters.append(replace(parameter, baseline=baseline) if apart else parameter)
    with placed(text, where, ("constraint",) if schema.constraint else ("parameter", len(parameters) - 1)):
        return Space(tuple(parameters), tuple(schema.constraint))


def _check_names(study: Study, text: str, where: str) -> None:
    """Whatever `columns` of a table, `variables` and `outputs` of a unit rename is there."""
    inputs, outputs = study.space.names, tuple(study.reductions)
    mapped = {
        "columns": ("parameters and responses", (*inputs, *outputs)),
        "variables": ("parameters", inputs),
        "outputs": ("responses", (*outputs, *study.model.get("keep", ()))),
    }
    for key, (what, known) in mapped.items():
        for name in study.model.get(key, ()):
            if name not in known:
                close = get_close_matches(name, known, n=1)
                hint = f". Did you mean {close[0]!r}?" if close else ""
                with placed(text, where, ("model", key, name)):
                    raise StudyError(
                        f"[model] {key} names {name!r}, which is none of the study's {what}: "
                        f"{', '.join(known)}{hint}"
                    )


def _check_design(study: Study, text: str, where: str) -> None:
    """The design can be drawn, as far as its table says; a table of runs is its own."""
    table = study.design
    if table is None or study.model["kind"] == "table":
        return
    with placed(text, where, ("design", "kind")):
        if table["kind"] == "table":
            if "file" not in table:
                raise StudyError("design kind 'table' needs file, a CSV with a column per parameter")
        elif "file" in table:
            raise StudyError(
                f"design kind {table['kind']!r} takes no file; a design in a CSV is of kind 'table'"
            )
        else:
            given = DesignOptions(**{key: table.get(key) for key in OPTIONS}).given()
            check_kind(table["kind"], runs=table.get("runs"), options=given)
    with placed(text, where, ("design", "up_to")):
        checked_up_to(table)


def _check_stages(study: Study, text: str, where: str) -> None:
    """The tables of stages against the parameters and responses."""
    if study.robust_layout is not None:
        with placed(text, where, ("robust_layout", "nominal")):
            _check_robust_layout(study)
        with placed(text, where, ("robust_layout", "required")):
            _check_required(study, study.robust_layout.get("required", {}))
    if study.robust is not None:
        check_robust(study.space, study.robust, kind=study.model["kind"], text=text, where=where)
    if study.screen is not None:
        with placed(text, where, ("screen",)):
            check_selection(study.space.names, **chosen(study.screen))
    for stage, named in (("screen", study.target), ("robust", study.response)):
        table = getattr(study, stage)
        if table is not None:
            with placed(text, where, (stage, "response")):
                named(table["response"])
    if study.worst_case is not None:
        for key, check in CHECKS.items():
            with placed(text, where, ("worst_case", key)):
                check(study, study.worst_case)


def _check_robust_layout(study: Study) -> None:
    """The nominal case lies in the uncertainty; the stage's documents are not those of another."""
    table = study.robust_layout or {}
    other = next((name for name in ("layout", "robust") if getattr(study, name) is not None), None)
    if other is not None:
        raise StudyError(f"[robust_layout] writes the documents of [{other}] itself; leave [{other}] out")
    given, names = table["nominal"], study.space.names
    missing, unknown = [n for n in names if n not in given], sorted(set(given) - set(names))
    if missing or unknown:
        raise StudyError(
            f"nominal needs every parameter; missing: {', '.join(missing) or 'none'}, "
            f"unknown: {', '.join(unknown) or 'none'}"
        )
    try:
        study.space.unit([given])
    except StudyError as exc:
        raise StudyError(f"the uncertainty excludes the nominal case: {exc}") from None
    if study.space.violated(given) is not None:
        raise StudyError(f"the nominal case breaks the constraint {study.space.violated(given)}")


def _check_required(study: Study, required: Mapping[str, Any]) -> None:
    """What is required is required of responses, and can be met."""
    for name, (low, high) in required.items():
        study.response(name)
        if low is None and high is None:
            raise StudyError(f"[robust_layout] required.{name} leaves both sides open. Leave it out")
        if low is not None and high is not None and low > high:
            raise StudyError(f"[robust_layout] required.{name} needs [low, high], got [{low:g}, {high:g}]")


def _reduction(table: Any) -> Reduction | None:
    if table.reduce is None:
        stray = next((key for key in ("at", "p") if getattr(table, key) is not None), None)
        if stray is not None:
            raise StudyError(f"response {table.name!r}: {stray} goes with reduce")
        return None
    if (table.reduce == "at") != (table.at is not None):
        raise StudyError(f"response {table.name!r}: reduce = 'at' and the time at = ... go together")
    if table.p is not None and table.reduce != "norm":
        raise StudyError(f"response {table.name!r}: p goes with reduce = 'norm'")
    return Reduction(kind=table.reduce, at=table.at, p=2.0 if table.p is None else table.p)


def _without_none(table: Any) -> Any:
    return None if table is None else {k: v for k, v in table.items() if v is not None}


def _near(path: Path) -> str:
    folder = path.parent
    names = sorted(p.name for p in folder.glob("*.toml"))[:5] if folder.is_dir() else []
    return f"; in {folder} there are {', '.join(names)}" if names else ""

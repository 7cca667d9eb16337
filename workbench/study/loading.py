"""A study: one typed TOML file, read into frozen records.

Every refusal is a `StudyError` that names the file, the line, the key path, what was expected and what came.
"""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.protocol import ModelSpec, Reduction
from workbench.models.reading_rules import checked_rule
from workbench.space.box import Parameter, Response, Space
from workbench.space.groups import check_selection, chosen
from workbench.study.messages import placed, validated
from workbench.study.robust_table import check_robust
from workbench.study.worst_case_targets import CHECKS

__all__ = ["Study", "json_schema", "load_study", "parse_study"]

LARGEST_FILE = 5_000_000  # bytes; a study file is written by a person
MEMORY = {"k": 1e3, "ki": 2**10, "M": 1e6, "Mi": 2**20, "G": 1e9, "Gi": 2**30, "T": 1e12, "Ti": 2**40}


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A study file as read: records for what the campaign needs, mappings for the tables of stages."""

    name: str
    seed: int
    space: Space
    responses: tuple[Response, ...]
    reductions: Mapping[str, Reduction | None]
    model: Mapping[str, Any]
    design: Mapping[str, Any] | None = None
    evaluate: Mapping[str, Any] = field(default_factory=dict)
    screen: Mapping[str, Any] | None = None
    worst_case: Mapping[str, Any] | None = None
    layout: Mapping[str, Any] | None = None
    robust: Mapping[str, Any] | None = None
    robust_layout: Mapping[str, Any] | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    reads: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    title: str | None = None
    path: Path | None = None
    text: str = ""

    @property
    def folder(self) -> Path:
        """Where the study file stands; relative paths in it start here."""
        return self.path.parent if self.path is not None else Path.cwd()

    @property
    def campaign_folder(self) -> Path:
        """Beside the study file, `welch20.toml` -> `welch20.holdfast`."""
        stem = self.path.stem if self.path is not None else self.name
        return self.folder / f"{stem}.holdfast"

    def response(self, name: str) -> Response:
        """The response of that name."""
        for response in self.responses:
            if response.name == name:
                return response
        raise StudyError(
            f"no response {name!r}; the responses are {', '.join(r.name for r in self.responses)}"
        )

    def spec(self, *, version: str) -> ModelSpec:
        """The model's description for workers. Where the study stands does not enter the identity of runs."""
        options = {k: v for k, v in self.model.items() if k not in ("kind", "version")}
        if self.reads:
            options["read"] = {name: dict(rule) for name, rule in self.reads.items()}
        words = [p.name for p in self.space.parameters if not p.is_numeric]
        if self.model["kind"] == "table" and words:
            options["words"] = words
        how = {name: found for name in self.reductions if (found := _how(self, name))}
        identity = json.dumps(
            {"kind": self.model["kind"], **_identifying(self.model), **({"responses": how} if how else {})},
            sort_keys=True,
        )
        return ModelSpec(
            kind=self.model["kind"],
            options=options,
            folder=str(self.folder.resolve()),
            names=self.space.names,
            responses=self.reductions,
            identity=identity,
            version=version,
        )

    @property
    def has_points(self) -> bool:
        """Whether the study says where to run the model, by a design or as a table of runs."""
        return self.design is not None or self.model["kind"] == "table"

    @property
    def memory_bytes(self) -> int | None:
        """The memory limit of one evaluation."""
        text = self.evaluate.get("memory")
        if text is None:
            return None
        number = text.rstrip("BkMGTi ")
        return int(float(number) * MEMORY[text[len(number) :].strip()[:-1]])

    @property
    def hash(self) -> str:
        """A digest of the file's content."""
        return blake2b(self.text.encode(), digest_size=16).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """The study with all defaults resolved, in plain types."""
        space = self.space.to_dict()
        responses = [{**r.to_dict(), **_how(self, r.name)} for r in self.responses]
        tables = (
            "model", "design", "evaluate", "screen", "worst_case", "layout", "robust", "robust_layout",
            "report",
        )  # fmt: skip
        return {
            "study": {"name": self.name, "seed": self.seed, "title": self.title},
            "parameter": space["parameters"],
            "constraint": space.get("constraints", []),
            "response": responses,
            **{name: None if (t := getattr(self, name)) is None else dict(t) for name in tables},
        }


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
        raise StudyError(f"{where} is not TOML: {exc}") from None
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
    parameters = []
    for k, table in enumerate(schema.parameter):
        given = {key: value for key, value in table.model_dump().items() if value is not None}
        with placed(text, where, ("parameter", k)):
            parameters.append(Parameter.from_dict(given))
    with placed(text, where, ("constraint",) if schema.constraint else ("parameter", len(parameters) - 1)):
        space = Space(tuple(parameters), tuple(schema.constraint))
    responses, reductions, reads = [], {}, {}
    for k, table in enumerate(schema.response):
        with placed(text, where, ("response", k)):
            response = Response(table.name, table.unit, label=table.label)
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
            responses.append(response)
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
        **{
            name: _without_none(dumped[name])
            for name in (
                "model", "design", "evaluate", "screen", "worst_case", "layout", "robust", "robust_layout",
                "report",
            )
        },
    )  # fmt: skip
    if study.robust_layout is not None:
        with placed(text, where, ("robust_layout", "nominal")):
            _check_robust_layout(study)
    if study.robust is not None:
        check_robust(study.space, study.robust, kind=study.model["kind"], text=text, where=where)
    if study.screen is not None:
        with placed(text, where, ("screen",)):
            check_selection(space.names, **chosen(study.screen))
    for stage in ("screen", "robust"):
        table = getattr(study, stage)
        if table is not None:
            with placed(text, where, (stage, "response")):
                study.response(table["response"])
    if study.worst_case is not None:
        for key, check in CHECKS.items():
            with placed(text, where, ("worst_case", key)):
                check(study, study.worst_case)
    return study


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


def _how(study: Study, name: str) -> dict[str, Any]:
    """How a response is read and reduced, for the resolved study."""
    rule, read = study.reductions[name], study.reads.get(name)
    out: dict[str, Any] = {} if rule is None else {"reduce": rule.kind, "at": rule.at, "p": rule.p}
    return out if read is None else {**out, "read": dict(read)}


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


def _identifying(model: Mapping[str, Any]) -> dict[str, Any]:
    # a gradient changes no response: runs made without it stay what they are
    return {k: v for k, v in model.items() if k not in ("kind", "version", "gradient")}


def _near(path: Path) -> str:
    folder = path.parent
    names = sorted(p.name for p in folder.glob("*.toml"))[:5] if folder.is_dir() else []
    return f"; in {folder} there are {', '.join(names)}" if names else ""

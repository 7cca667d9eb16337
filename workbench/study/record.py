"""A study as read: what it is called, its parameters and responses, and a mapping per table of the file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.functionals import Functional, functional_of
from workbench.models.histories import Reduction
from workbench.models.kept_files import LIMIT_ASKED, LIMIT_UNASKED, files_read
from workbench.models.protocol import ModelSpec
from workbench.space.box import Response, Space
from workbench.study.places import model_places

__all__ = ["TABLES", "Study", "bytes_in"]

# tables of the file that a study keeps as mappings, in the order in which a resolved study lists them
TABLES = (
    "model",
    "design",
    "evaluate",
    "screen",
    "worst_case",
    "layout",
    "robust",
    "robust_layout",
    "report",
)
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
    def where(self) -> str:
        """What a message calls the study file."""
        return self.path.name if self.path is not None else "study"

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

    def functional(self, name: str) -> Functional | None:
        """How a name is read off a history that runs keep; None for a response, and for any other name."""
        found = None if name in self.reductions else functional_of(name)
        return found if found is not None and found.history in self.kept_histories else None

    @property
    def kept_histories(self) -> tuple[str, ...]:
        """Names of time histories: of responses with a reduction, and what a function returns beside them."""
        reduced = [name for name, reduction in self.reductions.items() if reduction is not None]
        beside = self.model.get("keep") or () if self.model["kind"] == "python" else ()
        return tuple(dict.fromkeys((*reduced, *beside)))

    @property
    def functional_names(self) -> tuple[str, ...]:
        """What the screening and the worst case read off histories."""
        table = self.worst_case or {}
        named = [(self.screen or {}).get("response"), table.get("response")]
        named += [name for key in ("responses", "weights", "within") for name in table.get(key) or ()]
        return tuple(dict.fromkeys(n for n in named if n is not None and self.functional(n) is not None))

    def target(self, name: str) -> Response:
        """The response of that name, or what its words say of a history, such as "pc1 of force"."""
        functional = self.functional(name)
        if functional is not None:
            units = {response.name: response.unit for response in self.responses}
            return Response(functional.name, units.get(functional.history, "1"))
        wanted = functional_of(name)
        if wanted is None or name in self.reductions:
            return self.response(name)
        kept = ", ".join(self.kept_histories) or "none; a response with `reduce` is one"
        raise StudyError(
            f"{name!r} reads the time history {wanted.history!r}, which runs do not keep; kept are: {kept}"
        )

    def spec(self, *, version: str) -> ModelSpec:
        """The model's description for workers. Where the study stands does not enter the identity of runs."""
        options = {k: v for k, v in self.model.items() if k not in ("kind", "version", "state")}
        if self.model["kind"] == "command":
            options["read"] = {name: dict(rule) for name, rule in self.reads.items()}
            asked, limit = options.get("keep"), options.get("keep_limit")
            options["keep"] = files_read(self.reads) if asked is None else list(asked)
            unsaid = LIMIT_UNASKED if asked is None else LIMIT_ASKED
            options["keep_limit"] = unsaid if limit is None else bytes_in(limit)
        words = [p.name for p in self.space.parameters if not p.is_numeric]
        if self.model["kind"] == "table" and words:
            options["words"] = words
        identity = json.dumps({"kind": self.model["kind"], **_identifying(self.model)}, sort_keys=True)
        return ModelSpec(
            kind=self.model["kind"],
            options=options,
            folder=str(self.folder.resolve()),
            names=self.space.names,
            responses=self.reductions,
            identity=identity,
            version=version,
            places=model_places(
                self.text,
                self.where,
                model=self.model,
                parameters=self.space.names,
                responses=self.reductions,
            ),
        )

    @property
    def readings(self) -> dict[str, dict[str, Any]]:
        """Response -> how it is read and reduced: a run is a simulation, and this is how it is read."""
        found = {name: _how(self, name) for name in self.reductions}
        if self.model["kind"] == "fmu":
            for name, variable in self.model.get("outputs", {}).items():
                if name in found:
                    found[name]["variable"] = variable
        return found

    @property
    def has_points(self) -> bool:
        """Whether the study says where to run the model, by a design or as a table of runs."""
        return self.design is not None or self.model["kind"] == "table"

    @property
    def memory_bytes(self) -> int | None:
        """The memory limit of one evaluation."""
        text = self.evaluate.get("memory")
        return None if text is None else bytes_in(text)

    @property
    def hash(self) -> str:
        """A digest of the file's content."""
        return blake2b(self.text.encode(), digest_size=16).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """The study with all defaults resolved, in plain types."""
        space = self.space.to_dict()
        responses = [{**r.to_dict(), **_how(self, r.name)} for r in self.responses]
        return {
            "study": {"name": self.name, "seed": self.seed, "title": self.title},
            "parameter": space["parameters"],
            "constraint": space.get("constraints", []),
            "response": responses,
            **{name: None if (t := getattr(self, name)) is None else dict(t) for name in TABLES},
        }


def bytes_in(text: str) -> int:
    """Bytes of a size such as "2 GB" or "512 MiB".

    >>> bytes_in("2 kB"), bytes_in("0.5MiB")
    (2000, 524288)
    """
    number = text.rstrip("BkMGTi ")
    return int(float(number) * MEMORY[text[len(number) :].strip()[:-1]])


def _how(study: Study, name: str) -> dict[str, Any]:
    """How a response is read and reduced, for the resolved study."""
    rule, read = study.reductions[name], study.reads.get(name)
    out: dict[str, Any] = {} if rule is None else {"reduce": rule.kind, "at": rule.at, "p": rule.p}
    return out if read is None else {**out, "read": dict(read)}


def _identifying(model: Mapping[str, Any]) -> dict[str, Any]:
    # a gradient changes no response, and what is read, kept or watched no simulation: runs stay what they are
    reading = ("outputs",) if model["kind"] == "fmu" else ()
    apart = ("kind", "version", "gradient", "keep", "keep_limit", "state", *reading)
    return {k: v for k, v in model.items() if k not in apart}

"""The tables and keys of a study file, as pydantic models: types and defaults, unknown keys forbidden.

`workbench.study.loading` reads a file through them and turns every refusal into a message with file, line and
key. Nothing else of the workbench imports this module, because building the models takes a third of a second.
"""

from collections.abc import Mapping
from dataclasses import fields
from math import inf, isinf, isnan
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, create_model, model_validator

from workbench.models.histories import REDUCTIONS
from workbench.models.readers import KEYS, READERS
from workbench.sampling.kinds import DEFAULT, DesignOptions

__all__ = ["PATTERNS", "StudySchema"]

Count = Annotated[int, Field(ge=1)]
MOST_RUNS = 10_000_000  # a slip of the finger beyond: at a millisecond each they take three hours
Runs = Annotated[int, Field(ge=1, le=MOST_RUNS)]
Positive = Annotated[float, Field(gt=0)]
Text = Annotated[str, Field(min_length=1, max_length=1000)]
NAME, SIZE = r"^[A-Za-z0-9][A-Za-z0-9_. -]{0,99}$", r"^[0-9]+(\.[0-9]+)? ?[kMGT]i?B$"
PATTERNS = {
    NAME: "1 to 100 letters a to z, digits, '_', '.', '-' or spaces, a letter or digit first; a title holds "
    "others",
    SIZE: "a size such as '1.5 GB'",
}  # as a person reads them
Size = Annotated[str, Field(pattern=SIZE)]


def _number(limit: float) -> float:
    if isnan(limit):
        raise ValueError("a number, -inf or inf")
    return limit


def _open_sides(limits: list[float]) -> list[float | None]:
    """Infinity leaves a side of a pair of limits open: -inf the lower one, inf the upper one."""
    low, high = limits
    if low == inf or high == -inf:
        raise ValueError("[low, high] with -inf for no lower and inf for no upper limit")
    return [None if isinf(limit) else limit for limit in limits]


def _share(tolerance: float) -> float:
    if not tolerance < 1:
        raise ValueError("a share below 1, such as 0.02 for 2 %")
    return tolerance


Limit = Annotated[float, Field(allow_inf_nan=True), AfterValidator(_number)]
Share = Annotated[Positive, AfterValidator(_share)]
Limits = Annotated[list[Limit], Field(min_length=2, max_length=2), AfterValidator(_open_sides)]


class Table(BaseModel):
    """A table of the file: strict types, no unknown keys, no NaN."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class StudyTable(Table):
    """`[study]`: what the campaign is called and the one seed of everything random in it."""

    name: Annotated[str, Field(pattern=NAME)]
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    title: Text | None = None


class StateTable(Table):
    """`[model.state]`: what belongs to the state of the model beside what is found by itself: `include` and
    `exclude` are patterns of files beside the study file, `environment` names of variables."""

    include: list[Text] = Field(default_factory=list)
    exclude: list[Text] = Field(default_factory=list)
    environment: list[Text] = Field(default_factory=list)


class PythonTable(Table):
    """`[model] kind = "python"`; `gradient` names a function that returns the derivatives; `keep` histories
    that are no response and are kept, so that one may be read from them later."""

    kind: Literal["python"]
    function: Text
    gradient: Text | None = None
    keep: list[Text] | None = None
    state: StateTable | None = None
    version: Text = "1"


class TemplateTable(Table):
    """A deck: `from` in the study's folder, `to` in the run's."""

    from_: Annotated[Text, Field(alias="from")]
    to: Text
    style: Literal["jinja", "dakota"] = "jinja"


class CommandTable(Table):
    """`[model] kind = "command"`: an argument list, or several that run one after the other. `keep` names
    files of a run that are kept, `keep_limit` how much of them, compressed."""

    kind: Literal["command"]
    command: Annotated[list[Text] | list[Annotated[list[Text], Field(min_length=1)]], Field(min_length=1)]
    templates: list[TemplateTable] = Field(default_factory=list)
    files: list[Text] = Field(default_factory=list)
    environment: dict[str, str] = Field(default_factory=dict)
    keep: list[Text] | None = None
    keep_limit: Size | None = None
    state: StateTable | None = None
    version: Text = "1"


class FmuTable(Table):
    """`[model] kind = "fmu"`; `variables` and `outputs` map our names to those of the unit."""

    kind: Literal["fmu"]
    file: Text
    stop_time: Positive
    step: Positive | None = None
    variables: dict[str, str] = Field(default_factory=dict)
    outputs: dict[str, str] = Field(default_factory=dict)
    keep: list[Text] | None = None
    state: StateTable | None = None
    version: Text = "1"


class TableTable(Table):
    """`[model] kind = "table"`: runs made elsewhere; `columns` maps our names to the file's."""

    kind: Literal["table"]
    file: Text
    columns: dict[str, str] = Field(default_factory=dict)


class AskTable(Table):
    """`[model] kind = "ask"`: we write the rows to run, somebody else runs them and tells the results."""

    kind: Literal["ask"]
    version: Text = "1"


class ParameterTable(Table):
    """`[[parameter]]`."""

    name: Text
    lower: float | None = None
    upper: float | None = None
    unit: Text = "1"
    kind: Literal["continuous", "integer", "discrete", "binary", "categorical"] = "continuous"
    levels: list[float | str] | None = None
    step: float | None = None
    scale: Literal["linear", "log"] = "linear"
    baseline: float | str | None = None
    factor: list[float] | None = None
    label: Text | None = None
    distribution: dict[str, float | str] | None = None


def _optional(name: str, doc: str, types: Mapping[str, Any], **required: Any) -> type[Table]:
    """A table whose keys may all be left out, but for the `required` ones."""
    keys: dict[str, Any] = {key: (kind | None, None) for key, kind in types.items()}
    return create_model(name, __base__=Table, __doc__=doc, **required, **keys)


# what a key of a reader holds, by the words of `workbench.models.readers.KEYS`
HELD: dict[str, Any] = {
    "text": Text,
    "count": Count,
    "number": Annotated[int, Field(ge=0)],
    "name or count": Text | Count,
    "place": list[Count],
}

# no class that mypy could follow: the keys stand in the table of readers
ReadTable: Any = _optional(
    "ReadTable",
    "`read = { kind = ..., file = ..., ... }`: where a command leaves a response.",
    {key: HELD[held] if isinstance(held, str) else Literal[held] for key, held in KEYS.items()},
    kind=(Literal[tuple(READERS)], ...),
)


class ResponseTable(Table):
    """`[[response]]`: `reduce` says how a time history becomes a number; `regimes` names the lower
    and the upper one of a response that switches."""

    name: Text
    unit: Text = "1"
    label: Text | None = None
    reduce: Literal[tuple(REDUCTIONS)] | None = None  # type: ignore[valid-type]
    at: float | None = None
    p: Annotated[float, Field(ge=1)] | None = None
    read: ReadTable | None = None
    regimes: Annotated[list[Text], Field(min_length=2, max_length=2)] | None = None


def _option(option: Any) -> Any:
    """The type of an option of a design: a text, or a whole number from its least."""
    return Text if str in get_args(option.type) else Annotated[int, Field(ge=option.metadata.get("least", 1))]


DesignTable: Any = _optional(
    "DesignTable",
    "`[design]`: the options beside `kind` and `runs` belong to single kinds.",
    {
        "runs": Runs,
        "up_to": Runs,
        "file": Text,
        **{option.name: _option(option) for option in fields(DesignOptions)},
    },
    kind=(Text, DEFAULT),
)


class EvaluateTable(Table):
    """`[evaluate]`: how runs are made."""

    engine: Literal["processes", "inline", "dask"] = "processes"
    address: Text | None = None
    workers: Annotated[int, Field(ge=1, le=1024)] = 1
    timeout: Positive | None = None
    retries: Annotated[int, Field(ge=0, le=100)] = 0
    memory: Size | None = None
    scratch: Text | None = None


class ScreenTable(Table):
    """`[screen]`; `transform` is the scale to select by: left out it is chosen by left-out runs, and is none
    for the published methods; `groups` of parameters are selected together, and `n_selected` of them whatever
    the likelihood says; `regimes` says whether two of them are looked for."""

    response: Text
    method: Text = "default"
    transform: Literal["none", "auto", "log", "ranks", "box-cox", "yeo-johnson"] | None = None
    regimes: Literal["auto", "off"] = "auto"
    n_selected: Count | None = None
    groups: list[Annotated[list[Text], Field(min_length=2)]] | None = None


class WorstCaseTable(Table):
    """`[worst_case]` of one `response`, of several `responses` or of a sum with `weights`; `within` limits
    other responses; `quantile` asks for the value that is kept to with that chance, too. `batch` is how many
    runs the search proposes at once, whoever runs them; `enclosure` names a function that bounds the response
    over a box; `attack` is how many runs an adversary gets beside the budget, 1200 for the word *attacked*;
    `noise` says whether the model gives another value when it is run again, which is found out where nobody
    says; where it does, a budget that is not given is 120; `failures` "worst" counts a failed run as worse
    than any value; `transform` is the scale on which it is modelled."""

    response: Text | None = None
    responses: Annotated[dict[str, Literal["max", "min"]], Field(min_length=1)] | None = None
    weights: Annotated[dict[str, float], Field(min_length=1)] | None = None
    within: Annotated[dict[str, Limits], Field(min_length=1)] | None = None
    sense: Literal["max", "min"] | None = None
    budget: Runs = 60
    quantile: Annotated[float, Field(ge=0.5, le=0.99)] | None = None
    quantile_budget: Runs | None = None
    batch: Annotated[int, Field(ge=1, le=1024)] = 1
    tolerance: Share | None = None
    lipschitz: Positive | None = None
    enclosure: Text | None = None
    enclosure_calls: Count = 2000
    attack: Annotated[int, Field(ge=0, le=MOST_RUNS)] | None = None
    noise: bool | None = None
    failures: Literal["avoid", "worst"] | None = None
    transform: Literal["auto", "none", "log", "box-cox", "yeo-johnson"] | None = None

    @model_validator(mode="before")
    @classmethod
    def _more_runs_among_noise(cls, table: Any) -> Any:
        if isinstance(table, Mapping) and table.get("noise") is True:
            return {"budget": 120, **table}
        return table


class LayoutTable(Table):
    """`[layout]`: a problem of the engine; `scenarios` hands it the worst cases found. `whole` also looks
    for a layout of at most so many members, each off or on, in one of `whole_sizes` if there are any."""

    problem: Text
    options: dict[str, Any] = Field(default_factory=dict)
    scenarios: bool = False
    method: Text = "gsao"
    evaluations: Count = 50
    tolerance: Positive = 1e-6
    peaks: Text = "all"
    purified: bool = True
    whole: Count | None = None
    whole_evaluations: Annotated[int, Field(ge=2)] = 300
    whole_sizes: list[Positive] = Field(default_factory=list)


class RobustDesignTable(Table):
    """`[[robust.design]]`: parameters that are ours to choose, by name; the others are uncertain."""

    name: Text
    values: Annotated[dict[str, float | str], Field(min_length=1)]


class RobustTable(Table):
    """`[robust]`: designs beside each other over the whole uncertainty; `screened` of the samples tell which
    parameters matter to each. The price of robustness is read at `nominal`: values of uncertain parameters,
    the baseline of those not named."""

    response: Text
    design: Annotated[list[RobustDesignTable], Field(min_length=1)]
    sense: Literal["max", "min"] = "max"
    samples: Annotated[int, Field(ge=10, le=MOST_RUNS)] = 100
    screened: Annotated[int, Field(ge=10)] | None = None
    limit: float | None = None
    nominal: Annotated[dict[str, float | str], Field(min_length=1)] | None = None


class LayoutVariantTable(Table):
    """`[[robust_layout.variant]]`: other options of the layout model, optimised for the final cases."""

    name: Text
    options: Annotated[dict[str, Any], Field(min_length=1)]


class RobustLayoutTable(Table):
    """`[robust_layout]`: layout for the worst cases found, worst case of that layout, in turn. `required`
    says between which values responses of the layout have to stay, infinity leaves a side open."""

    model: Text
    options: dict[str, Any] = Field(default_factory=dict)
    nominal: Annotated[dict[str, float | str], Field(min_length=1)]
    start: Literal["nominal", "worst_case"] = "nominal"
    scenarios: Annotated[int, Field(ge=0)] = 24
    evaluations: Count = 30
    budget: Runs = 1500
    corners: Annotated[int, Field(ge=0)] = 100
    scouts: Annotated[int, Field(ge=0)] | None = None
    joining: Annotated[int, Field(ge=1, le=12)] = 6
    rounds: Annotated[int, Field(ge=1, le=100)] = 12
    tolerance: Share = 0.02
    samples: Annotated[int, Field(ge=10, le=MOST_RUNS)] = 1000
    limit: float | None = None
    required: Annotated[dict[str, Limits], Field(min_length=1)] | None = None
    variant: list[LayoutVariantTable] = Field(default_factory=list)


class ReportTable(Table):
    """`[report]`."""

    title: Text | None = None


class StudySchema(Table):
    """The whole file."""

    study: StudyTable
    model: Annotated[
        PythonTable | CommandTable | FmuTable | TableTable | AskTable, Field(discriminator="kind")
    ]
    parameter: Annotated[list[ParameterTable], Field(min_length=1)]
    response: Annotated[list[ResponseTable], Field(min_length=1)]
    constraint: list[Text] = Field(default_factory=list)
    design: DesignTable | None = None
    evaluate: EvaluateTable = Field(default_factory=lambda: EvaluateTable())
    screen: ScreenTable | None = None
    worst_case: WorstCaseTable | None = None
    layout: LayoutTable | None = None
    robust: RobustTable | None = None
    robust_layout: RobustLayoutTable | None = None
    report: ReportTable = Field(default_factory=lambda: ReportTable())

"""What a study would do next: stages, runs to make, runs already made, and how long that takes."""

from collections import Counter
from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from statistics import median
from typing import Any

from workbench.campaign.lock import CURE, model_change
from workbench.campaign.read_rows import known_reading
from workbench.campaign.rereading import KEPT, looked_at
from workbench.campaign.store import Store
from workbench.campaign.view import CampaignView
from workbench.errors import StudyError
from workbench.models.stored.evaluation import UNFINISHED
from workbench.provenance.content import ContentCache
from workbench.provenance.named import model_files
from workbench.provenance.reading import readings_now
from workbench.provenance.state import model_state
from workbench.report.lines.tables import fitted, hanging
from workbench.sampling.change import change_sentence, design_change, serves_on
from workbench.sampling.stored import MOST_ROWS, design_head, design_keys
from workbench.sampling.verdict import cost_of_growth
from workbench.space.units import counted
from workbench.stages.design import answered_runs
from workbench.stages.run_all import stage_digest
from workbench.stages.table import STAGES, Stage, asked_stages
from workbench.stages.up_to_date import current_document
from workbench.study.record import Study
from workbench.system.atomic import read_json

__all__ = ["duration", "plan_lines", "plan_study", "room"]

# batches whose runs are those of the study's model
TIMED = tuple(stage.name for stage in STAGES if stage.runs_model)


def plan_study(study: Study, folder: Path | None = None) -> dict[str, Any]:
    """Per stage the runs it may make and the time they take; runs stored by status; seconds per run.

    The time is a forecast: runs still to be made times the median duration of the stored ones, over as many
    workers as a stage keeps busy. Searches count with their whole budget. `seconds_left_at_most` is None as
    long as no run of a kind that is needed has been timed.
    """
    place = folder or study.campaign_folder
    document: dict[str, Any] = {
        "folder": str(place),
        "stages": [*(stage.name for stage in asked_stages(study)), "report"],
        "runs": {
            stage.name: stage.work.planned_runs(study, place)
            for stage in asked_stages(study)
            if stage.work.planned_runs is not None
            and not (stage.runs_model and study.model["kind"] == "table")  # its runs are all there
        },
        "stored": {},
        "others": 0,
        "seconds_per_run": None,
        "workers": study.evaluate.get("workers", 1),
    }
    if not (place / "runs.sqlite").exists():
        return _timed(document, study, dict(document["runs"]), _Pace(place))
    with CampaignView.opened(study, folder=place) as view:
        now = view.as_of
        document["as_of"] = {**now.to_dict(), "sentence": now.sentence}
        counts, walls = _counted(view)
        document["stored"] = dict(counts)
        document["others"] = sum(view.store.counts().values()) - counts.total()
        current = {stage.name: _is_current(view, stage) for stage in asked_stages(study)}
        if counts or document["others"]:  # runs with other parameters are refused, or serve by a baseline
            document |= _served(view, is_current=current.get("design", False))
        left = _runs_left(view, document, current)
    pace = _Pace(place, walls)
    document["seconds_per_run"] = pace.of("design")
    return _timed(document, study, left, pace)


def _counted(view: CampaignView) -> tuple[Counter[str], list[float]]:
    """How many runs have each status, and the seconds of those of the study's model."""
    counts: Counter[str] = Counter()
    walls: list[float] = []
    for some in view.chunks():
        counts.update(some.statuses)
        timed = zip(some.wall, some.batches, strict=True)
        walls += [wall for wall, batch in timed if wall is not None and batch in TIMED]
    return counts, walls


def _is_current(view: CampaignView, stage: Stage) -> bool:
    """Whether the document of a stage is up to date."""
    read = design_head if stage.name == "design" else read_json
    return current_document(view, stage, stage_digest(view, stage), read=read) is not None


class _Pace:
    """Seconds per run: the median of the stored runs of the study's model, and of those of layouts."""

    def __init__(self, place: Path, walls: Sequence[float] = ()) -> None:
        self._model = median(walls) if walls else None
        self._layouts = _layout_pace(place)

    def of(self, stage: str) -> float | None:
        """None where no run has been timed yet."""
        return self._layouts if stage == "robust_layout" else self._model


def _layout_pace(place: Path) -> float | None:
    database = place / "layouts.sqlite"
    if not database.exists():
        return None
    store = Store.reading(database)
    try:
        walls = [row.wall for row in store.rows() if row.wall is not None]
    finally:
        store.close()
    return median(walls) if walls else None


def _runs_left(
    view: CampaignView, document: Mapping[str, Any], current: Mapping[str, bool]
) -> dict[str, int | None]:
    """Runs that each stage has still to make, at most; None where nobody can tell.

    current: whether the document of each stage is up to date.
    """
    left: dict[str, int | None] = dict(document["runs"])
    is_whole = True
    for stage in asked_stages(view.study):
        is_current = current[stage.name]
        if stage.name == "design" and "design" in left:
            left["design"] = _design_left(view, document, is_current=is_current)
            is_whole = left["design"] == 0
        elif stage.name in left and is_whole and is_current:
            left[stage.name] = 0
    return left


def _design_left(view: CampaignView, document: Mapping[str, Any], *, is_current: bool) -> int | None:
    """Rows of the design without an answer: of the one that is there, or of the one that it becomes."""
    keys = design_keys(view.folder / "design.json")
    change = document.get("design")
    if keys is None or (change is None and not is_current):
        runs: int | None = (view.study.design or {}).get("runs")
        return runs
    if change is not None:
        return int(change["new"] + change["waiting"])
    return _unanswered(view, keys)


def _unanswered(view: CampaignView, keys: Sequence[str]) -> int:
    statuses = view.store.statuses(keys)
    return sum(statuses.get(key, "queued") in UNFINISHED for key in dict.fromkeys(keys))


def _timed(
    document: dict[str, Any], study: Study, left: Mapping[str, int | None], pace: _Pace
) -> dict[str, Any]:
    """The document with runs left and seconds per stage, and the whole."""
    workers = document["workers"]
    time: dict[str, dict[str, Any]] = {}
    for name, runs in left.items():
        at_once = min(workers, (study.worst_case or {}).get("batch", 1)) if name == "worst_case" else workers
        seconds = pace.of(name)
        whole = None if runs is None or seconds is None else ceil(runs / at_once) * seconds
        time[name] = {"runs": runs, "at_once": at_once, "seconds": 0.0 if runs == 0 else whole}
    every = [stage["seconds"] for stage in time.values()]
    known = None if None in every else sum(every)
    return {**document, "time": time, "seconds_left_at_most": known}


def _served(view: CampaignView, *, is_current: bool) -> dict[str, Any]:
    """What stored runs serve for: the design, the responses, and the room that their files take.

    is_current: the design is the one that the study asks for.
    """
    found: dict[str, Any] = {}
    study, place, spec, store = view.study, view.folder, view.spec, view.store
    if study.model["kind"] == "table":
        return found
    design = design_head(place / "design.json")
    if study.design is None or design is None or study.design["kind"] == "table":
        pass
    elif is_current and design["n"] > MOST_ROWS:  # as it is: its points need not be looked at
        found |= _whole_design(view, study.design["kind"], design["n"])
    else:
        design = read_json(place / "design.json")
        answered = answered_runs(design, view.statuses(), view.key)
        try:
            change = design_change(
                study.space, study.design, design, answered, seed=study.seed, at_baseline=False
            )
            if change is not None:
                found["design"] = {
                    "serve": len(change.kept),
                    "new": change.new,
                    "waiting": sum(
                        run in change.kept and not has_answer
                        for run, has_answer in zip(design["run_ids"], answered, strict=True)
                    ),
                    "left_out": dict(change.left_out),
                    "sentence": change.sentence,
                    "growth": None if change.new else cost_of_growth(design),
                }
        except StudyError as exc:
            found["refused"] = str(exc)
    cache = ContentCache(place / ".content.json", keeps=False)
    wanted = study.model.get("state") or {}
    changed = model_change(store, model_state(spec, wanted, cache=cache), spec)
    if changed is not None:
        found["changed"] = {
            "runs": changed.runs,
            "changes": changed.changes,
            "sentence": f"`run` refuses: {changed.sentence(place.name)}. {CURE}",
        }
    readings = readings_now(study.readings, spec, model_files(spec), wanted, cache=cache)
    if known_reading(store, readings):
        reading = looked_at(store, place, spec, readings)
        found["reading"] = {
            "read_again": reading.read,
            "cannot_be_read": len(reading.missing),
            "response": reading.response,
            "reason": reading.reason,
        }
    sizes = [path.stat().st_size for path in (place / KEPT).glob("*.zip")]
    if sizes:
        found["kept"] = {"runs": len(sizes), "bytes_per_run": sum(sizes) / len(sizes)}
    return found


def _whole_design(view: CampaignView, kind: str, runs: int) -> dict[str, Any]:
    """What `design_change` says of a design of very many runs in which nothing changes.

    What growing cost is told of smaller ones.
    """
    waiting = _unanswered(view, design_keys(view.folder / "design.json") or [])
    if waiting == runs or not serves_on(kind):
        return {}
    found = {"serve": runs, "new": 0, "waiting": waiting, "left_out": {}, "growth": None}
    return {"design": found | {"sentence": change_sentence(runs, 0, {})}}


def _served_lines(document: dict[str, Any]) -> list[str]:
    lines = []
    if "refused" in document:
        lines += hanging("", document["refused"], indent=2)
    if "changed" in document:
        lines += fitted([document["changed"]["sentence"]])
    if "design" in document:
        lines.append(document["design"]["sentence"])
        if document["design"]["new"]:
            lines.append("`holdfast design` places them, and says what growing costs; it runs nothing")
        elif document["design"].get("growth"):
            lines += fitted([document["design"]["growth"]])
    reading = document.get("reading", {})
    if reading.get("read_again"):
        stored = counted(reading["read_again"], "stored run")
        lines.append(f"the responses of {stored} are read again; nothing is run")
    if reading.get("cannot_be_read"):
        missing = reading["cannot_be_read"]
        lines.append(
            f"response {reading['response']!r} cannot be read from {counted(missing, 'stored run')}: "
            f"{reading['reason']}; --run-again makes {'it' if missing == 1 else 'them'} anew"
        )
    if "kept" in document:
        kept = document["kept"]
        more = ""
        if "design" in document and document["design"]["new"]:
            new = document["design"]["new"]
            more = f", about {room(new * kept['bytes_per_run'])} for {new} more"
        lines.append(f"files kept: {room(kept['bytes_per_run'])} a run{more}")
    return lines


def plan_lines(document: dict[str, Any]) -> list[str]:
    """The plan for a person."""
    runs = []
    for name, n in document["runs"].items():
        count = "as many runs as the kind has" if n is None else f"up to {counted(n, 'run')}"
        runs.append(f"{name.replace('_', ' ')}: {count}")
    stored = ", ".join(f"{n} {status}" for status, n in document["stored"].items()) or "none"
    others = f"; {document['others']} of other models, versions or parameters" if document["others"] else ""
    lines = [f"stages: {', '.join(document['stages'])}", *runs]
    lines.append(f"stored in {document['folder']}: {stored}{others}")
    lines += [document["as_of"]["sentence"]] if "as_of" in document else []
    lines += _served_lines(document)
    return [*lines, *_time_lines(document)]


def _time_lines(document: dict[str, Any]) -> list[str]:
    """How long what is left takes, stage by stage."""
    lines = []
    for name, stage in document["time"].items():
        runs, seconds, word = stage["runs"], stage["seconds"], name.replace("_", " ")
        if runs == 0:
            lines.append(f"time of {word}: none, all its runs are there")
        elif seconds is None:
            why = "until the first run" if runs is not None else "until its kind has drawn its points"
            lines.append(f"time of {word}: unknown {why}")
        else:
            at_once = f", {stage['at_once']} at once" if stage["at_once"] > 1 else ""
            most = "" if name == "design" else "at most "
            lines.append(f"time of {word}: {most}{duration(seconds)} ({counted(runs, 'run')}{at_once})")
    pace, left = document["seconds_per_run"], document["seconds_left_at_most"]
    if pace is not None:
        lines.append(f"a run takes {pace:.3g} s, the median of those that are stored")
    if left is not None and len(document["time"]) > 1:
        lines.append(f"together at most {duration(left)}")
    return lines


def room(size: float) -> str:
    """Bytes in words that a person plans by.

    >>> room(145.0), room(2180.0), room(3.2e9)
    ('145 bytes', '2.18 kB', '3.2 GB')
    """
    for unit, one in (("bytes", 1.0), ("kB", 1e3), ("MB", 1e6)):
        if size < 1000.0 * one:
            return f"{size / one:.3g} {unit}"
    return f"{size / 1e9:.3g} GB"


def duration(seconds: float) -> str:
    """Seconds in words that a person plans by.

    >>> duration(0.25), duration(95), duration(4000), duration(200_000)
    ('0.25 s', '95 s', '67 min', '2.3 days')
    """
    for unit, size, most in (("s", 1.0, 120.0), ("min", 60.0, 120.0), ("h", 3600.0, 48.0)):
        if seconds < most * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds / 86400.0:.2g} days"

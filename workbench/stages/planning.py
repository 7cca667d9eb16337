"""What a study would do next: stages, runs to make, runs already made, time at the pace so far."""

from collections import Counter
from pathlib import Path
from typing import Any

from workbench.campaign.lock import present_version
from workbench.campaign.read_rows import known_reading
from workbench.campaign.rereading import KEPT, looked_at
from workbench.campaign.store import Store, run_key
from workbench.campaign.view import as_of
from workbench.errors import StudyError
from workbench.models.evaluation import UNFINISHED
from workbench.sampling.change import design_change
from workbench.stages.design import answered_runs
from workbench.stages.table import STAGES, asked_stages
from workbench.study.record import Study
from workbench.system.atomic import read_json

__all__ = ["plan_lines", "plan_study"]

# batches whose runs are those of the study's model
TIMED = tuple(stage.name for stage in STAGES if stage.runs_model)


def plan_study(study: Study, folder: Path | None = None) -> dict[str, Any]:
    """Per stage the runs it may make; runs stored by status; seconds per run; seconds left at most."""
    place = folder or study.campaign_folder
    counts: Counter[str] = Counter()
    walls: list[float] = []
    looked: dict[str, Any] = {}
    if (place / "runs.sqlite").exists():
        store = Store.reading(place / "runs.sqlite")
        try:
            rows = store.rows()
            now = as_of(store)
            looked = {"as_of": {**now.to_dict(), "sentence": now.sentence}}
        finally:
            store.close()
        counts.update(row.status for row in rows)
        walls = [row.wall for row in rows if row.wall is not None and row.batch in TIMED]
    runs = {
        stage.name: stage.work.planned_runs(study, place)
        for stage in asked_stages(study)
        if stage.work.planned_runs is not None
        and not (stage.runs_model and study.model["kind"] == "table")  # its runs are all there
    }
    done = sum(n for status, n in counts.items() if status not in UNFINISHED)
    pace = sum(walls) / len(walls) if walls else None
    most = sum(n for n in runs.values() if n)
    left = None if pace is None else max(most - done, 0) * pace / study.evaluate.get("workers", 1)
    return {
        **(_served(study, place) if counts else {}),
        **looked,
        "folder": str(place),
        "stages": [*(stage.name for stage in asked_stages(study)), "report"],
        "runs": runs,
        "stored": dict(counts),
        "seconds_per_run": pace,
        "seconds_left_at_most": left,
        "workers": study.evaluate.get("workers", 1),
    }


def _served(study: Study, place: Path) -> dict[str, Any]:
    """What stored runs serve for: the design, the responses, and the room that their files take."""
    found: dict[str, Any] = {}
    if study.model["kind"] == "table":
        return found
    spec = study.spec(version=str(study.model["version"]))
    store = Store.reading(place / "runs.sqlite")
    try:
        spec = study.spec(version=present_version(store, spec.version))
        design = read_json(place / "design.json")
        if study.design is not None and design is not None and study.design["kind"] != "table":
            answered = answered_runs(
                design, store.statuses, lambda row: run_key(spec.identity, spec.version, row)
            )
            try:
                change = design_change(
                    study.space, study.design, design, answered, seed=study.seed, at_baseline=False
                )
                if change is not None:
                    found["design"] = {
                        "serve": len(change.kept),
                        "new": change.new,
                        "left_out": dict(change.left_out),
                        "sentence": change.sentence,
                    }
            except StudyError as exc:
                found["refused"] = str(exc)
        if known_reading(store, study.readings):
            reading = looked_at(store, place, spec, study.readings)[1]
            found["reading"] = {
                "read_again": reading.read,
                "cannot_be_read": len(reading.missing),
                "response": reading.response,
                "reason": reading.reason,
            }
    finally:
        store.close()
    sizes = [path.stat().st_size for path in (place / KEPT).glob("*.zip")]
    if sizes:
        found["kept"] = {"runs": len(sizes), "bytes_per_run": sum(sizes) / len(sizes)}
    return found


def _served_lines(document: dict[str, Any]) -> list[str]:
    lines = []
    if "refused" in document:
        lines.append(document["refused"])
    if "design" in document:
        lines.append(document["design"]["sentence"])
    reading = document.get("reading", {})
    if reading.get("read_again"):
        lines.append(f"the responses of {reading['read_again']} stored runs are read again; nothing is run")
    if reading.get("cannot_be_read"):
        lines.append(
            f"response {reading['response']!r} cannot be read from {reading['cannot_be_read']} stored runs: "
            f"{reading['reason']}; --run-again makes them anew"
        )
    if "kept" in document:
        kept = document["kept"]
        more = ""
        if "design" in document and document["design"]["new"]:
            new = document["design"]["new"]
            more = f", about {new * kept['bytes_per_run'] / 1e6:.3g} MB for {new} more"
        lines.append(f"files kept: {kept['bytes_per_run'] / 1e3:.3g} kB a run{more}")
    return lines


def plan_lines(document: dict[str, Any]) -> list[str]:
    """The plan for a person."""
    runs = []
    for name, n in document["runs"].items():
        count = "as many runs as the kind has" if n is None else f"up to {n} runs"
        runs.append(f"{name.replace('_', ' ')}: {count}")
    stored = ", ".join(f"{n} {status}" for status, n in document["stored"].items()) or "none"
    lines = [f"stages: {', '.join(document['stages'])}", *runs, f"stored in {document['folder']}: {stored}"]
    lines += [document["as_of"]["sentence"]] if "as_of" in document else []
    lines += _served_lines(document)
    pace, workers = document["seconds_per_run"], document["workers"]
    if pace is None:
        return [*lines, "no run has been timed yet"]
    left = f"at most {document['seconds_left_at_most']:.3g} s left with {workers} workers"
    return [*lines, f"{pace:.3g} s per run so far; {left}"]

"""What a study would do next: stages, runs to make, runs already made, time at the pace so far."""

from collections import Counter
from pathlib import Path
from typing import Any

from workbench.campaign.store import Store
from workbench.models.evaluation import UNFINISHED
from workbench.stages.table import STAGES, asked_stages
from workbench.study.record import Study

__all__ = ["plan_lines", "plan_study"]

# batches whose runs are those of the study's model
TIMED = tuple(stage.name for stage in STAGES if stage.runs_model)


def plan_study(study: Study, folder: Path | None = None) -> dict[str, Any]:
    """Per stage the runs it may make; runs stored by status; seconds per run; seconds left at most."""
    place = folder or study.campaign_folder
    counts: Counter[str] = Counter()
    walls: list[float] = []
    if (place / "runs.sqlite").exists():
        store = Store.reading(place / "runs.sqlite")
        try:
            rows = store.rows()
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
        "folder": str(place),
        "stages": [*(stage.name for stage in asked_stages(study)), "report"],
        "runs": runs,
        "stored": dict(counts),
        "seconds_per_run": pace,
        "seconds_left_at_most": left,
        "workers": study.evaluate.get("workers", 1),
    }


def plan_lines(document: dict[str, Any]) -> list[str]:
    """The plan for a person."""
    runs = []
    for name, n in document["runs"].items():
        count = "as many runs as the kind has" if n is None else f"up to {n} runs"
        runs.append(f"{name.replace('_', ' ')}: {count}")
    stored = ", ".join(f"{n} {status}" for status, n in document["stored"].items()) or "none"
    lines = [f"stages: {', '.join(document['stages'])}", *runs, f"stored in {document['folder']}: {stored}"]
    pace, workers = document["seconds_per_run"], document["workers"]
    if pace is None:
        return [*lines, "no run has been timed yet"]
    left = f"at most {document['seconds_left_at_most']:.3g} s left with {workers} workers"
    return [*lines, f"{pace:.3g} s per run so far; {left}"]

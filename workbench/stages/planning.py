"""What a study would do next: stages, runs to make, runs already made, time at the pace so far."""

from collections import Counter
from pathlib import Path
from typing import Any

from workbench.campaign.store import Store
from workbench.stages.validation import STAGES
from workbench.study.record import Study
from workbench.study.robust_table import comparison_of
from workbench.study.worst_case_targets import QUANTILE_BUDGET
from workbench.system.atomic import read_json

__all__ = ["plan_lines", "plan_study"]

TIMED = ("design", "worst_case", "robust")  # batches whose runs are those of the study's model


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
    runs = {}
    if study.design is not None and study.model["kind"] != "table":
        document = read_json(place / "design.json")
        runs["design"] = document["n"] if document else study.design.get("runs")
    if study.worst_case is not None and study.model["kind"] != "table":
        table = study.worst_case
        more = table.get("quantile_budget", QUANTILE_BUDGET) if "quantile" in table else 0
        runs["worst_case"] = table["budget"] + more
    if study.robust is not None:
        at_nominal = comparison_of(study.space, study.robust).nominal is not None
        runs["robust"] = len(study.robust["design"]) * (study.robust["samples"] + at_nominal)
    if study.robust_layout is not None:
        table = study.robust_layout
        # three baselines beside the rounds, and three layouts at every sample
        searches = table["rounds"] + 3
        runs["robust_layout"] = searches * (table["budget"] + table["corners"]) + 3 * table["samples"]
    done = sum(n for status, n in counts.items() if status not in ("queued", "running"))
    pace = sum(walls) / len(walls) if walls else None
    most = sum(n for n in runs.values() if n)
    left = None if pace is None else max(most - done, 0) * pace / study.evaluate.get("workers", 1)
    stages = [n for n in STAGES if getattr(study, n) is not None]
    return {
        "folder": str(place),
        "stages": [*stages, "report"],
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

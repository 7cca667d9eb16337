"""Failures as data: which runs gave no value, in whose words, and where in the input space they sit.

For every numeric parameter the best single cut "above t" or "below t" between failed and good runs is sought;
its score is Youden's J, share of failures beyond the cut minus share of good runs beyond it (1 separates
them, 0 says nothing). Words are cut by level.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from workbench.models.stored.evaluation import FAILED, Evaluation, alike, cause_of
from workbench.space.box import Space

__all__ = ["Cut", "failure_document", "failure_lines", "what_is_missing", "where_runs_fail"]

WORDS = {
    "failed": "failed",
    "timeout": "ran out of time",
    "killed": "were killed",
    "nonfinite": "gave no finite number",
}
CLEAR = 0.5  # Youden's J from which a cut is worth telling
FEWEST = 3  # failures below which no place is named
SHOWN = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Failures sit where `parameter` is above (or below) `threshold`, or is the word `level`."""

    parameter: str
    side: str  # above | below | is
    threshold: Any
    failed_beyond: int
    failed: int
    good_beyond: int
    good: int

    @property
    def score(self) -> float:
        """Youden's J."""
        return self.failed_beyond / self.failed - self.good_beyond / self.good

    def text(self, unit: str) -> str:
        """The cut in words."""
        value = self.threshold if isinstance(self.threshold, str) else f"{self.threshold:.5g}"
        shown = f"{self.parameter} {self.side} {value}{'' if unit == '1' else f' {unit}'}"
        counts = (
            f"{self.failed_beyond} of {self.failed} failures, {self.good_beyond} of {self.good} good runs"
        )
        return f"{shown}: {counts}"


def where_runs_fail(runs: Sequence[Evaluation], space: Space) -> list[Cut]:
    """The best cut per parameter, best first; empty without failures or without good runs."""
    failed = [r.inputs for r in runs if r.status in FAILED]
    good = [r.inputs for r in runs if r.status == "ok"]
    if len(failed) < FEWEST or not good:
        return []
    cuts = [_best_cut(p.name, failed, good, numeric=p.is_numeric) for p in space.parameters]
    return sorted(cuts, key=lambda cut: -cut.score)


def failure_document(runs: Sequence[Evaluation], space: Space) -> dict[str, Any]:
    """Counts by status, every failed run, and where failures sit, in plain types."""
    bad = [r for r in runs if r.status in FAILED]
    return {
        "counts": dict(Counter(r.status for r in runs)),
        "errors": {cause: len(runs) for cause, runs in alike(bad)},
        "runs": [
            {"id": r.id, "key": r.key, "status": r.status, "attempt": r.attempt, "error": r.error,
             "log": r.log, "parameters": dict(r.inputs)}
            for r in bad
        ],
        "where": [
            {"parameter": c.parameter, "side": c.side, "threshold": c.threshold, "score": c.score,
             "text": c.text(space[c.parameter].unit)}
            for c in where_runs_fail(runs, space)
        ],
    }  # fmt: skip


def failure_lines(document: Mapping[str, Any]) -> list[str]:
    """The failures for a person."""
    bad = document["runs"]
    if not bad:
        return ["no run failed"]
    lines = [f"{count:>5}  {text}" for text, count in document["errors"].items()]
    lines = [f"{len(bad)} runs without a value of {sum(document['counts'].values())}", "", *lines, ""]
    for run in bad[:SHOWN]:
        values = ", ".join(
            f"{k}={v:.5g}" if isinstance(v, float) else f"{k}={v}" for k, v in run["parameters"].items()
        )
        lines.append(
            f"run {run['id']} ({run['key'][:10]}) {run['status']}: {cause_of(run['error'], run['log'])}"
        )
        lines.append(f"    {values}")
    if len(bad) > SHOWN:
        lines.append(f"... and {len(bad) - SHOWN} more (--json has all)")
    clear = [c["text"] for c in document["where"] if c["score"] >= CLEAR]
    if clear:
        lines += ["", "failures sit where", *(f"    {text}" for text in clear[:5])]
    elif len(bad) >= FEWEST:
        lines += ["", "no single parameter tells failed runs from good ones"]
    return lines


def what_is_missing(counts: Mapping[str, int]) -> str:
    """Why so few runs have a value, by status, and what to do.

    >>> print(what_is_missing({"ok": 1, "failed": 58, "timeout": 1}))
    58 failed, 1 ran out of time. `holdfast failures` shows which, why and where;
    `holdfast run --retry-failed` tries them again
    >>> print(what_is_missing({}))
    nothing has been run yet. Run the study with `holdfast run`, or hand in results with `holdfast tell`
    """
    bad = [f"{counts[status]} {words}" for status, words in WORDS.items() if counts.get(status)]
    if bad:
        return (
            f"{', '.join(bad)}. `holdfast failures` shows which, why and where; "
            "`holdfast run --retry-failed` tries them again"
        )
    if not counts:
        told = "hand in results with `holdfast tell`"
        return f"nothing has been run yet. Run the study with `holdfast run`, or {told}"
    return "add runs"


def _best_cut(
    name: str, failed: Sequence[Mapping[str, Any]], good: Sequence[Mapping[str, Any]], *, numeric: bool
) -> Cut:
    bad_values, good_values = [r[name] for r in failed], [r[name] for r in good]
    cuts = []
    levels = sorted({*bad_values, *good_values})
    if not numeric:
        sides = [("is", level) for level in levels]
    else:
        middles = [(a + b) / 2 for a, b in pairwise(levels)]
        sides = [(side, t) for t in middles or levels for side in ("above", "below")]
    for side, threshold in sides:
        beyond = [sum(_beyond(v, side, threshold) for v in values) for values in (bad_values, good_values)]
        cuts.append(
            Cut(
                parameter=name,
                side=side,
                threshold=threshold,
                failed_beyond=beyond[0],
                failed=len(failed),
                good_beyond=beyond[1],
                good=len(good),
            )
        )
    return max(cuts, key=lambda cut: cut.score)


def _beyond(value: Any, side: str, threshold: Any) -> bool:
    if side == "is":
        return bool(value == threshold)
    return bool(value > threshold) if side == "above" else bool(value < threshold)

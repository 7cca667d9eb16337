"""Failures as data: which runs gave no value, in whose words, and where in the input space they sit.

For every numeric parameter the best single cut "above t" or "below t" between failed and good runs is sought;
its score is Youden's J, share of failures beyond the cut minus share of good runs beyond it (1 separates
them, 0 says nothing). Words are cut by level.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.models.stored.causes import cause_of, kept_in
from workbench.models.stored.evaluation import FAILED, Evaluation, alike
from workbench.space.box import Space
from workbench.space.units import counted

__all__ = ["Cut", "failure_document", "failure_lines", "what_is_missing", "where_runs_fail"]

WORDS = {
    "failed": "failed",
    "timeout": "ran out of time",
    "killed": "were killed",
    "nonfinite": "gave no number that can be modelled",
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
    without = f"{counted(len(bad), 'run')} without a value of {sum(document['counts'].values())}"
    lines = [without, "", *lines, ""]
    for run in bad[:SHOWN]:
        values = ", ".join(
            f"{k}={v:.5g}" if isinstance(v, float) else f"{k}={v}" for k, v in run["parameters"].items()
        )
        lines.append(
            f"run {run['id']} ({run['key'][:10]}) {run['status']}: {cause_of(run['error'], run['log'])}"
        )
        lines.append(f"    {values}")
        if place := kept_in(run["error"]):
            lines.append(f"    kept in {place}")
    if len(bad) > SHOWN:
        lines.append(f"... and {len(bad) - SHOWN} more (--json has all)")
    clear = [c["text"] for c in document["where"] if c["score"] >= CLEAR]
    if clear:
        lines += ["", "failures sit where", *(f"    {text}" for text in clear[:5])]
    elif len(bad) >= FEWEST:
        lines += ["", "no single parameter tells failed runs from good ones"]
    return lines


def what_is_missing(counts: Mapping[str, int], *, waiting: int = 0, under_way: bool = False) -> str:
    """Why so few runs have a value, by status, and what to do.

    waiting: runs that are asked for and not counted, as they have no answer.    under_way: whether another
    process is at them.

    >>> print(what_is_missing({"ok": 1, "failed": 58, "timeout": 1}))
    58 failed, 1 ran out of time. `holdfast failures` shows which, why and where;
    `holdfast run --retry-failed` tries them again
    >>> print(what_is_missing({}))
    nothing has been run yet. Run the study with `holdfast run`, or hand in results with `holdfast tell`
    >>> print(what_is_missing({"ok": 1}, waiting=5))
    5 runs wait for their answers. Make them with `holdfast run`, or hand in results with `holdfast tell`
    >>> print(what_is_missing({"ok": 1}, waiting=5, under_way=True))
    5 runs have no answer yet and are being made. Look again when more have ended
    """
    if waiting and under_way:
        runs = counted(waiting, "run has", "runs have")
        are = "is" if waiting == 1 else "are"
        return f"{runs} no answer yet and {are} being made. Look again when more have ended"
    bad = [f"{counts[status]} {words}" for status, words in WORDS.items() if counts.get(status)]
    if bad:
        return (
            f"{', '.join(bad)}. `holdfast failures` shows which, why and where; "
            "`holdfast run --retry-failed` tries them again"
        )
    told = "hand in results with `holdfast tell`"
    if waiting:
        runs = counted(waiting, "run waits for its answer", "runs wait for their answers")
        return f"{runs}. Make {'it' if waiting == 1 else 'them'} with `holdfast run`, or {told}"
    if not counts:
        return f"nothing has been run yet. Run the study with `holdfast run`, or {told}"
    return "add runs"


def _best_cut(
    name: str, failed: Sequence[Mapping[str, Any]], good: Sequence[Mapping[str, Any]], *, numeric: bool
) -> Cut:
    bad_values, good_values = [r[name] for r in failed], [r[name] for r in good]
    if numeric:
        side, threshold, bad_beyond, good_beyond = _best_threshold(bad_values, good_values)
    else:
        bad_counts, good_counts = Counter(bad_values), Counter(good_values)
        side, threshold = (
            "is",
            max(
                sorted({*bad_values, *good_values}),
                key=lambda level: bad_counts[level] / len(failed) - good_counts[level] / len(good),
            ),
        )
        bad_beyond, good_beyond = bad_counts[threshold], good_counts[threshold]
    return Cut(
        parameter=name,
        side=side,
        threshold=threshold,
        failed_beyond=bad_beyond,
        failed=len(failed),
        good_beyond=good_beyond,
        good=len(good),
    )


def _best_threshold(bad: Sequence[float], good: Sequence[float]) -> tuple[str, float, int, int]:
    """Side and threshold of the best cut, and how many failures and good runs lie beyond it.

    Thresholds lie halfway between neighbouring values; sorted once, each is one look-up.
    """
    low, high = np.sort(np.asarray(bad, dtype=float)), np.sort(np.asarray(good, dtype=float))
    levels = np.unique(np.concatenate([low, high]))
    thresholds = (levels[1:] + levels[:-1]) / 2 if len(levels) > 1 else levels
    below = [np.searchsorted(values, thresholds, side="left") for values in (low, high)]
    above = [len(v) - np.searchsorted(v, thresholds, side="right") for v in (low, high)]
    counts = np.array([above, below])  # (side, failures or good runs, threshold)
    scores = counts[:, 0] / len(low) - counts[:, 1] / len(high)
    at, side = divmod(int(np.argmax(scores.T)), 2)
    beyond = counts[side, :, at]
    return ("above", "below")[side], float(thresholds[at]), int(beyond[0]), int(beyond[1])

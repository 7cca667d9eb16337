"""Functionals of stored histories: a number per run, such as the score of a mode over a design's runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from workbench.errors import EvaluationFailed, NotEnoughRuns, StudyError
from workbench.histories.modes import Modes, modes_of
from workbench.histories.stack import stacked_anyway
from workbench.histories.store import FILE
from workbench.histories.stored import StoredHistories
from workbench.models.functionals import Functional
from workbench.models.histories import History

__all__ = ["Share", "functional_values", "share_of_mode"]

SAMPLES = 1_000  # times that modes are found at: evenly many of longer histories
RUNS = 1_000  # of a design that modes are found from: evenly many of more
MOST = 20  # modes


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """What a mode holds of the variance of a history over time, from how many runs of the design."""

    history: str
    mode: int
    share: float
    runs: int

    @property
    def sentence(self) -> str:
        """For a person."""
        return (
            f"pc{self.mode}_of_{self.history} is the score of principal component {self.mode} over "
            f"{self.runs} runs of the design, which holds {100 * self.share:.3g} % of the variance of "
            f"{self.history} over time"
        )


def functional_values(
    folder: Path, functional: Functional, keys: Sequence[str], *, design: Sequence[str]
) -> dict[str, float]:
    """The number of every run; NaN where its history has none there, as at a time that it did not reach.

    `design`: the runs with a value over which modes are defined.

    Raises:
        StudyError: runs have no such history.    NotEnoughRuns: the design has no such mode.
    """
    found: dict[str, float] = {}
    missing = []
    modes = _modes(folder, functional, design) if functional.mode else None
    with StoredHistories(folder) as stored:
        for key in keys:
            histories = stored.of(key)
            if functional.history not in histories:
                missing.append(key)
                continue
            history = histories[functional.history][0]
            if modes is not None:
                found[key] = float(
                    modes.scores(_at_times(history, modes.times)[None])[0, functional.mode - 1]
                )
                continue
            assert functional.reduction is not None
            try:
                found[key] = functional.reduction.of(history)
            except EvaluationFailed:
                found[key] = float("nan")
    if missing:
        raise StudyError(
            f"{functional.name!r} needs the time history {functional.history!r}, which {len(missing)} of "
            f"{len(keys)} runs have not kept, the first {missing[0][:10]}. --run-again makes runs anew whose "
            "histories a response with `reduce` or [model] keep asks for"
        )
    return found


def share_of_mode(folder: Path, functional: Functional, *, design: Sequence[str]) -> Share:
    """What the mode of a functional holds.

    Raises:
        NotEnoughRuns: the design has no such mode.
    """
    modes = _modes(folder, functional, design)
    share = float(modes.shares[functional.mode - 1])
    return Share(history=functional.history, mode=functional.mode, share=share, runs=modes.runs)


def _at_times(history: History, times: np.ndarray) -> np.ndarray:
    """The values at `times`, on straight lines between samples; NaN outside."""
    if not len(history.time):
        return np.full(len(times), np.nan)
    return np.interp(times, history.time, history.values, left=np.nan, right=np.nan)


def _modes(folder: Path, functional: Functional, design: Sequence[str]) -> Modes:
    place = folder / FILE
    state = place.stat().st_mtime_ns if place.exists() else 0
    modes = _modes_of_design(folder, functional.history, tuple(design), state)
    if len(modes.shares) < functional.mode:
        raise NotEnoughRuns(
            f"{functional.name!r}: the {modes.runs} runs of the design differ in {len(modes.shares)} modes "
            f"of {functional.history!r} alone"
        )
    return modes


@lru_cache(maxsize=16)
def _modes_of_design(folder: Path, history: str, design: tuple[str, ...], _state: int) -> Modes:
    """The modes over a design; found once for the many runs of a search that are read by them."""
    stack = stacked_anyway(folder, history, design, samples=SAMPLES)
    samples = np.unique(np.linspace(0, len(stack.times) - 1, SAMPLES).astype(int))
    chosen = np.unique(np.linspace(0, len(stack.entries) - 1, RUNS).astype(int))
    values = stack.values(chosen, samples)
    whole = values[np.isfinite(values).all(axis=1)]
    try:
        return modes_of(whole, stack.times[samples], count=MOST)
    except NotEnoughRuns as exc:
        raise NotEnoughRuns(f"principal components of {history!r} over the design: {exc}") from None

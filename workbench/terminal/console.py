"""Progress of a campaign in the terminal.

On a terminal, runs are shown as a bar with rate, time left and failures; elsewhere as plain lines, few enough
for a log file.
"""

import math
import sys
import time
from collections.abc import Callable, Mapping
from typing import TextIO

from workbench.models.stored.evaluation import FAILED
from workbench.report.lines.tables import format_number, unit_suffix

__all__ = ["PlainProgress", "RichProgress", "progress_for"]

EVERY = 5.0  # s between plain lines
FORETELLS = 2  # answers from which on a time left is told: the first holds the start of the workers
FAILURES = (*FAILED, "skipped")
TITLES = {"worst_case": "worst case"}


def progress_for(stream: TextIO) -> "PlainProgress | RichProgress":
    """The listener that fits the stream."""
    return RichProgress(stream) if stream.isatty() else PlainProgress(stream)


class PlainProgress:
    """Plain lines: one per stage, and one every few seconds while runs come in."""

    def __init__(self, stream: TextIO = sys.stderr) -> None:
        self._stream = stream
        self._begun = self._last = time.monotonic()
        self._first: int | None = None

    def stage(self, name: str, detail: str) -> None:
        """A line for the stage."""
        self._begun = self._last = time.monotonic()
        self._first = None
        self._say(f"{TITLES.get(name, name):<11} {detail}".rstrip())

    def runs(self, done: int, total: int, counts: Mapping[str, int]) -> None:
        """A line now and then, and one for the last run."""
        now = time.monotonic()
        self._first = done if self._first is None else self._first
        if done < total and now - self._last < EVERY:
            return
        self._last = now
        answered = done - self._first
        rate = answered / max(now - self._begun, 1e-9)
        left = ""
        if done < total and answered >= FORETELLS:
            left = f", {_duration((total - done) / rate)} left"
        pace = f", {_rate(rate)}" if rate > 0 else ""
        self._say(f"  {done}/{total} runs{pace}{left}{_failed(counts)}")

    def search(
        self, run: int, budget: int, *, proposal: str, value: float | None, best: float, name: str, unit: str
    ) -> None:
        """A line when the worst case rises, and for every tenth run."""
        if run and (run % 10 == 0 or value == best):
            self._say(f"  run {run} of at most {budget}: {_worst_so_far(best, name, unit)}")

    def note(self, text: str) -> None:
        """A line."""
        self._say(f"note: {text}")

    def finished(self) -> None:
        """Nothing is left open."""

    def _say(self, text: str) -> None:
        print(text, file=self._stream, flush=True)


class RichProgress:
    """One line that is rewritten while runs come in."""

    def __init__(self, stream: TextIO = sys.stderr) -> None:
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        self._console = Console(file=stream, highlight=False)
        self._text = Text
        self._live: Live | None = None
        self._new_live: Callable[[], Live] = lambda: Live(
            console=self._console, transient=True, refresh_per_second=8
        )
        self._plain = PlainProgress(stream)
        self._begun = time.monotonic()
        self._first: int | None = None

    def stage(self, name: str, detail: str) -> None:
        """A line that stays."""
        self.finished()
        self._begun, self._first = time.monotonic(), None
        self._console.print(self._text.assemble((f"{TITLES.get(name, name):<12}", "bold"), detail))

    def runs(self, done: int, total: int, counts: Mapping[str, int]) -> None:
        """The bar."""
        self._first = done if self._first is None else self._first
        answered = done - self._first
        rate = answered / max(time.monotonic() - self._begun, 1e-9)
        filled = int(30 * done / max(total, 1))
        bar = "━" * filled + "─" * (30 - filled)
        left = _duration((total - done) / rate) if answered >= FORETELLS else "?"
        self._show(f"  {bar} {done}/{total}  {_rate(rate)}  {left} left{_failed(counts)}")
        if done >= total:
            self.finished()

    def search(
        self, run: int, budget: int, *, proposal: str, value: float | None, best: float, name: str, unit: str
    ) -> None:
        """The state of the search."""
        if run:
            self._show(f"  run {run} of at most {budget} ({proposal}): {_worst_so_far(best, name, unit)}")

    def note(self, text: str) -> None:
        """A line that stays."""
        self._console.print(self._text(f"note: {text}", style="yellow"))

    def finished(self) -> None:
        """Take the rewritten line away."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _show(self, line: str) -> None:
        if self._live is None:
            self._live = self._new_live()
            self._live.start()
        self._live.update(self._text(line))


def _worst_so_far(best: float, name: str, unit: str) -> str:
    if math.isinf(best):
        return "the worst so far is a run that failed"
    if math.isnan(best):
        return "no run has given a value so far"
    return f"worst so far {name} = {format_number(best)}{unit_suffix(unit)}"


def _rate(rate: float) -> str:
    return f"{rate:.3g} runs/s" if rate >= 0.1 else f"{60 * rate:.3g} runs/min"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _failed(counts: Mapping[str, int]) -> str:
    bad = [f"{counts[s]} {s}" for s in FAILURES if counts.get(s)]
    return f"; {', '.join(bad)}" if bad else ""

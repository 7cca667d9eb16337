"""What a person sees in the terminal: progress of a campaign, the screening path, the worst case.

On a terminal, runs are shown as a bar with rate, time left and failures; elsewhere as plain lines, few enough
for a log file.
"""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TextIO

__all__ = [
    "PlainProgress",
    "RichProgress",
    "design_lines",
    "format_number",
    "progress_for",
    "screening_lines",
    "worst_case_lines",
]

EVERY = 5.0  # s between plain lines
FAILURES = ("failed", "timeout", "killed", "nonfinite", "skipped")
QUALITIES = ("min_distance", "cd2", "max_correlation", "d_efficiency")
TITLES = {"worst_case": "worst case"}


def format_number(value: float | None, digits: int = 5) -> str:
    """A number for a person: significant digits, "-" for none.

    >>> format_number(-50.16789), format_number(0.0000123), format_number(None)
    ('-50.168', '1.23e-05', '-')
    """
    return "-" if value is None else f"{value:.{digits}g}"


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
        self._first = done - 1 if self._first is None else self._first
        if done < total and now - self._last < EVERY:
            return
        self._last = now
        seconds = max(now - self._begun, 1e-9)
        rate = (done - self._first) / seconds
        left = "" if done >= total else f", {_duration((total - done) / rate)} left"
        self._say(f"  {done}/{total} runs, {_rate(rate)}{left}{_failed(counts)}")

    def search(
        self, run: int, budget: int, proposal: str, value: float | None, best: float, name: str, unit: str
    ) -> None:
        """A line when the worst case rises, and for every tenth run."""
        if run and (run % 10 == 0 or value == best):
            self._say(
                f"  run {run} of at most {budget}: worst so far {name} = {format_number(best)}{_unit(unit)}"
            )

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
        self._first = done - 1 if self._first is None else self._first
        rate = (done - self._first) / max(time.monotonic() - self._begun, 1e-9)
        filled = int(30 * done / max(total, 1))
        bar = "━" * filled + "─" * (30 - filled)
        left = _duration((total - done) / rate) if rate > 0 else "?"
        self._show(f"  {bar} {done}/{total}  {_rate(rate)}  {left} left{_failed(counts)}")
        if done >= total:
            self.finished()

    def search(
        self, run: int, budget: int, proposal: str, value: float | None, best: float, name: str, unit: str
    ) -> None:
        """The state of the search."""
        if run:
            shown = f"worst so far {name} = {format_number(best)}{_unit(unit)}"
            self._show(f"  run {run} of at most {budget} ({proposal}): {shown}")

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


def design_lines(document: Mapping[str, Any]) -> list[str]:
    """How good the design is, each measure beside random Latin hypercubes of the same size."""
    quality = document.get("quality") or {}
    rows = []
    for name in QUALITIES:
        entry = quality.get(name)
        if entry is None or entry["value"] is None or entry["percentile"] is None:
            continue
        beaten = entry["percentile"] if entry["better"] == "high" else 100 - entry["percentile"]
        rows.append((name.replace("_", " "), f"better than {beaten:.0f} %", format_number(entry["value"], 4)))
    if not rows:
        return []
    return table_lines(("design quality", "of random Latin hypercubes", "value"), rows)


def screening_lines(document: Mapping[str, Any]) -> list[str]:
    """The screening path in the form of Table 3.1 of the dissertation, and what was selected."""
    head = ("step", "selected so far", "theta", "sigma^2", "restricted log-likelihood")
    accepted = [step for step in document["path"] if step.get("accepted", True)]
    rejected = [step for step in document["path"] if not step.get("accepted", True)]
    rows = [
        (
            str(step["step"]),
            ", ".join(step["selected"]) + ("" if step.get("accepted", True) else "  (not\u00a0accepted)"),
            format_number(step["theta_common"], 4),
            format_number(step["sigma2"], 5),
            format_number(step["log_likelihood"], 6),
        )
        for step in [*accepted, *rejected[:1]]
    ]
    names = ", ".join(document["selected"]) or "none"
    unit = _unit(document.get("unit", "1")).strip()
    text = [f"Screening of {document['response']}{f' [{unit}]' if unit else ''}: {document['method']}"]
    text += table_lines(head, rows)
    text.append("theta: common range parameter of the variables not selected, on the unit cube")
    if len(rejected) > 1:
        text.append(f"{len(rejected) - 1} further steps were tried, none accepted")
    text.append(f"selected: {names}")
    text += [str(document[key]) for key in ("verdict", "advice") if document.get(key)]
    if document.get("n_left_out"):
        text.append(f"{document['n_left_out']} runs without a value were left out")
    return text


def worst_case_lines(document: Mapping[str, Any]) -> list[str]:
    """The worst case, what it rests on, and what remains open."""
    unit = _unit(document["unit"])
    word = {"max": "largest", "min": "smallest"}[document["sense"]]
    text = [f"Worst case ({word} {document['response']}): {format_number(document['value'], 6)}{unit}"]
    runs = f"; {document['evaluations']} runs of at most {document['budget']}" if document["budget"] else ""
    text.append(f"  {document['label']}{runs}")
    if document.get("status"):
        text.append(f"  stopped because {document['status']}")
    gap = document.get("gap") or {}
    if gap.get("upper") is not None:
        what = "model-based bound, not a proof" if gap["kind"] == "model-based" else gap["kind"]
        text.append(f"  could be as far as {format_number(gap['upper'], 6)}{unit} ({what})")
    failures = document.get("failures") or {}
    if failures:
        text.append("  runs without a value: " + ", ".join(f"{n} {status}" for status, n in failures.items()))
    width = max(len(name) for name in document["parameters"])
    text += [f"  {name:<{width}} = {_value(value)}" for name, value in document["parameters"].items()]
    return text


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]], *, width: int = 79) -> list[str]:
    """A table of at most `width` columns; a long second cell continues below itself."""
    others = sum(max(len(r[k]) for r in (head, *rows)) + 2 for k in range(len(head)) if k != 1)
    room = max(width - others, 14)
    wrapped = [[[r[0]], _wrapped(r[1], room), *([c] for c in r[2:])] for r in (head, *rows)]
    sizes = [max(len(line) for r in wrapped for line in r[k]) for k in range(len(head))]
    text = []
    for n, row in enumerate(wrapped):
        for line in range(max(map(len, row))):
            cells = [cell[line] if line < len(cell) else "" for cell in row]
            text.append(
                "  ".join(
                    f"{c:<{s}}" if k < 2 else f"{c:>{s}}"
                    for k, (c, s) in enumerate(zip(cells, sizes, strict=True))
                ).rstrip()
            )
        if n == 0:
            text.append("  ".join("-" * s for s in sizes))
    return text


def _wrapped(text: str, width: int) -> list[str]:
    import textwrap

    lines = textwrap.wrap(text, width, break_long_words=False) or [""]
    return [line.replace("\u00a0", " ") for line in lines]


def _value(value: Any) -> str:
    return (
        format_number(value, 6)
        if isinstance(value, int | float) and not isinstance(value, bool)
        else str(value)
    )


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _rate(rate: float) -> str:
    return f"{rate:.3g} runs/s" if rate >= 0.1 else f"{60 * rate:.3g} runs/min"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _failed(counts: Mapping[str, int]) -> str:
    bad = [f"{counts[s]} {s}" for s in FAILURES if counts.get(s)]
    return f"; {', '.join(bad)}" if bad else ""

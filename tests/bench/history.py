"""The times that `make bench` prints, as rows of a CSV file: commit, date, machine, test, row, seconds.

A printed line such as "1020 members, 200 steps   gradient   12.3 ms" becomes the row
"1020 members, 200 steps gradient" with 0.0123 s: the first number with a unit of time counts.
"""

import csv
import os
import platform
import re
import subprocess
from datetime import UTC, datetime
from pathlib import Path

__all__ = ["HEADER", "append", "commit_of", "machine", "timed_row"]

HEADER = ("commit", "date", "machine", "test", "row", "seconds")
NUMBER = r"\d+(?:\.\d*)?(?:e[-+]?\d+)?"
TIMES = (
    re.compile(rf"(?P<unit>CPU s)\s+(?P<number>{NUMBER})"),
    re.compile(rf"(?P<number>{NUMBER})\s*(?P<unit>CPU s|ms|s)\b"),
)
UNITS = {"ms": 1e-3, "s": 1.0, "CPU s": 1.0}


def timed_row(line: str) -> tuple[str, float] | None:
    """What a printed line says and its first time in s; None when it holds no time."""
    match = next(filter(None, (pattern.search(line) for pattern in TIMES)), None)
    if match is None:
        return None
    return " ".join(line[: match.start()].split()), float(match["number"]) * UNITS[match["unit"]]


def commit_of(root: Path) -> str:
    """The short name of the commit, with + where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True).stdout

    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!tests/bench/history.csv")
    return git("rev-parse", "--short", "HEAD").strip() + ("+" if changed else "")


def machine() -> str:
    """Processor, number of cores and Python: what a time depends on beside the code."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        named = re.search(r"^model name\s*:\s*(.+)$", cpuinfo.read_text(), re.MULTILINE)
        model = named.group(1) if named else model
    return f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}"


def append(file: Path, commit: str, rows: list[tuple[str, str, float]]) -> None:
    """Add (test, row, seconds) to the file, below a header if the file is new."""
    new = not file.exists()
    day = datetime.now(UTC).date().isoformat()
    with file.open("a", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        if new:
            writer.writerow(HEADER)
        writer.writerows((commit, day, machine(), test, row, f"{s:.6g}") for test, row, s in rows)

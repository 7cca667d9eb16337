"""A page in a real browser: Chromium without a head, from the command line, nothing installed.

`visit(path)` returns the document after scripts have run, every console message, and every URL that the
browser asked for beyond the file itself, read from Chromium's own network log.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-extensions",
    "--hide-scrollbars", "--enable-logging=stderr", "--host-resolver-rules=MAP * ~NOTFOUND",
)  # fmt: skip
SECONDS = 120

needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on this machine: looked for chromium"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Visit:
    """What came of opening a page."""

    dom: str
    console: list[str]
    asked: list[str]


def visit(page: Path, *, width: int = 1280, height: int = 900, fragment: str = "", gl: bool = False) -> Visit:
    """Open a file and wait until its scripts have run."""
    with tempfile.TemporaryDirectory() as profile:
        log = Path(profile) / "net.json"
        dom, messages = _chromium(
            profile, f"--log-net-log={log}", "--dump-dom", "--virtual-time-budget=4000",
            f"--window-size={width},{height}", page.resolve().as_uri() + fragment, gl=gl,
        )  # fmt: skip
        asked = _asked(log)
    console = re.findall(r"INFO:CONSOLE[^\]]*\] (.*)", messages)
    return Visit(dom=dom, console=console, asked=asked)


def print_pdf(page: Path, pdf: Path) -> None:
    """Print a page."""
    with tempfile.TemporaryDirectory() as profile:
        _chromium(profile, f"--print-to-pdf={pdf}", "--no-pdf-header-footer", page.resolve().as_uri())


def _chromium(profile: str, *arguments: str, gl: bool = False) -> tuple[str, str]:
    assert CHROMIUM is not None
    flags = [flag for flag in FLAGS if not (gl and flag == "--disable-gpu")]
    if gl:
        flags += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    process = subprocess.Popen(
        [CHROMIUM, *flags, f"--user-data-dir={profile}", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "HOME": profile},
    )  # fmt: skip
    try:
        out, err = process.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)  # the browser is many processes
        process.communicate()
        raise
    assert process.returncode == 0, err
    return out, err


def _asked(log: Path) -> list[str]:
    """URLs over the network in Chromium's log."""
    text = log.read_text()
    try:
        events = json.loads(text)["events"]
    except ValueError:  # the browser ended before the last line was written
        events = json.loads(text.rstrip().rstrip(",") + "]}")["events"]
    # requests without an origin are Chromium's own (its clock, its updates), not the page's
    made = [e.get("params", {}) for e in events]
    urls = {
        str(p["url"]) for p in made if "url" in p and p.get("initiator", "not an origin") != "not an origin"
    }
    return sorted(url for url in urls if re.match(r"(https?|wss?|ftp):", url))

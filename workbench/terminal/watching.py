"""A campaign from outside while it runs: a table for the terminal, and a static page that reloads itself."""

import html
import time
from pathlib import Path
from typing import Any

from workbench.campaign.store import Store
from workbench.campaign.store_schema import STATUSES
from workbench.campaign.view import as_of
from workbench.models.stored.evaluation import UNFINISHED
from workbench.system.atomic import write_text

__all__ = ["page", "state", "state_lines", "write_page"]

RECENT = 60.0  # s over which the pace is taken
LATEST = 10


def state(folder: Path, *, now: float | None = None) -> dict[str, Any]:
    """Counts by status, pace, time left, the best values so far and the latest failures.

    Raises:
        StoreError: there is no database in the folder.
    """
    now = time.time() if now is None else now
    store = Store.reading(folder / "runs.sqlite")
    try:
        counts = store.counts()
        recent = store.rows_since(now - RECENT)
        failed = store.latest_failures(LATEST)
        best = store.extremes()
        looked = as_of(store)
    finally:
        store.close()
    done = sum(n for status, n in counts.items() if status not in UNFINISHED)
    left = counts.get("queued", 0) + counts.get("running", 0)
    rate = recent / RECENT
    return {
        "folder": str(folder),
        "as_of": {**looked.to_dict(), "sentence": looked.sentence},
        "counts": {status: counts[status] for status in STATUSES if status in counts},
        "done": done,
        "left": left,
        "runs_per_second": rate,
        "seconds_left": left / rate if rate > 0 and left else None,
        "extremes": best,
        "failures": [{"key": key, "status": status, "error": error} for key, status, error in failed],
    }


def state_lines(found: dict[str, Any]) -> list[str]:
    """The state for a terminal of 80 columns."""
    counts = ", ".join(f"{n} {status}" for status, n in found["counts"].items()) or "no runs yet"
    lines = [f"{found['folder']}: {counts}", f"  {found['as_of']['sentence']}"]
    if found["left"]:
        pace = f"{60 * found['runs_per_second']:.3g} runs/min"
        left = "" if found["seconds_left"] is None else f", about {found['seconds_left'] / 60:.3g} min left"
        lines.append(f"{found['done']} done, {found['left']} to go; {pace}{left}")
    for name, (low, high) in found["extremes"].items():
        lines.append(f"  {name}: {low:.6g} .. {high:.6g}")
    for failure in found["failures"]:
        text = failure["error"].splitlines()[0] if failure["error"] else ""
        lines.append(f"  {failure['key'][:10]} {failure['status']}: {text}"[:80])
    return lines


def page(found: dict[str, Any], *, every: int) -> str:
    """The state as a page without scripts that loads itself again after `every` seconds."""
    rows = "".join(f"<tr><td>{status}</td><td>{n}</td></tr>" for status, n in found["counts"].items())
    failed = "".join(
        f"<tr><td><code>{f['key'][:10]}</code></td><td>{f['status']}</td><td>{html.escape(f['error'])}</td></tr>"
        for f in found["failures"]
    )
    text = html.escape("\n".join(state_lines(found)))
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f'<meta http-equiv="refresh" content="{every}"><meta name="viewport" content="width=device-width">'
        "<title>holdfast campaign</title><style>body{font:16px/1.5 sans-serif;"
        "margin:2rem auto;max-width:50rem;"
        "padding:0 1rem}table{border-collapse:collapse}td{border-bottom:1px solid #ccc;padding:.2rem .8rem}"
        "pre{white-space:pre-wrap}</style></head><body>"
        f"<h1>{html.escape(Path(found['folder']).name)}</h1><pre>{text}</pre><table>{rows}</table>"
        f"<h2>Latest failures</h2><table>{failed or '<tr><td>none</td></tr>'}</table></body></html>\n"
    )


def write_page(path: Path, found: dict[str, Any], *, every: int) -> None:
    """Write the page whole."""
    write_text(path, page(found, every=every))

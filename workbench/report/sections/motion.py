"""The motion: the viewer, time histories before and after, and a storyboard that prints."""

import html
import json
from base64 import b64encode
from typing import Any

import numpy as np

from workbench.figures.loop import plot_history
from workbench.motion.frames import Motion, frame_at
from workbench.motion.framing import camera_on_occupant
from workbench.motion.stills import png, still
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Html,
    Panel,
    Section,
    Table,
    names_of,
    number,
)
from workbench.report.page.folder import CampaignFolder

__all__ = ["motion_section"]

MOST_STILLS = 6
MOST_ROWS = 60
WIDTH, HEIGHT = 400, 250
SHADES = 4  # of 256 that a still makes one: no eye sees it, and a third of its bytes is saved
FLAT = 1e-4  # m: what moves less across the plane than stored poses resolve is planar


def motion_section(folder: CampaignFolder) -> Section | None:
    """None without `motion.json`."""
    document = folder["motion"]
    if document is None:
        return None
    motion = Motion.from_dict(document)
    labels = list(dict.fromkeys(run.label for run in motion.runs))
    first = motion.cases[0]
    blocks: list[Block] = [_viewer(document), _storyboard(motion)]
    blocks += [_history(motion, k) for k, h in enumerate(motion.histories) if h.case == first]
    others = [case for case in motion.cases if case != first]
    duration = float(motion.times[-1] - motion.times[0])
    return Section(
        id="motion",
        title="The motion",
        sentences=(
            f"{motion.title[:1].upper()}{motion.title[1:]}: {names_of(labels)}, {number(duration, 3)} s, "
            f"{len(motion.times)} frames."
            + (f" Stills and figures show {first}; the viewer also {names_of(others)}." if others else ""),
            "Drag to turn; with the focus on a picture the wheel or plus and minus zoom, and a click on a "
            "member shows what it bears over time. The line in the time histories follows the slider.",
            "A belt is a band, an airbag a volume, a retractor dashes that glow while it fires; thickness is "
            "density. In the stills a belt is a plain line and an airbag a row of beads.",
        ),
        blocks=tuple(blocks),
        numbers={
            "runs": labels,
            "frames": len(motion.times),
            "cases": list(motion.cases),
            "peaks": {
                h.name: {label: float(np.max(values)) for label, values in h.series.items()}
                for h in motion.histories
                if h.case == first
            },
        },
    )


def _viewer(document: Any) -> Html:
    content = json.dumps(document, sort_keys=True, allow_nan=False, separators=(",", ":")).replace(
        "<", "\\u003c"
    )
    markup = (
        '<div id="viewer-panel" class="screen-only"><p>The motion needs JavaScript; the stills below show it.'
        f'</p></div>\n<script type="application/json" id="viewer-data">{content}</script>'
    )
    return Html(id="viewer", markup=markup, text="The motion stands in `report.html`.")


def _storyboard(motion: Motion) -> Html:
    times = motion.storyboard or tuple(np.linspace(motion.times[0], motion.times[-1], 4).tolist())
    rows = []
    for run, label in enumerate(r.label for r in motion.runs if r.case == motion.cases[0]):
        cells = []
        for time in times[:MOST_STILLS]:
            camera = camera_on_occupant(motion, frame_at(motion.times, time), run=run, preset=_view(motion))
            seen = still(motion, run=run, time=time, camera=camera, width=WIDTH, height=HEIGHT)
            image = png(seen - seen % SHADES + SHADES // 2)
            words = html.escape(f"{label}, {number(float(time), 3)} s")
            cells.append(
                f'<figure><img width="{WIDTH}" height="{HEIGHT}" alt="The scene {words}" '
                f'src="data:image/png;base64,{b64encode(image).decode()}"><figcaption>{words}</figcaption></figure>'
            )
        rows.append(f'<div class="stills">{"".join(cells)}</div>')
    return Html(
        id="storyboard",
        markup="".join(rows),
        text=f"{len(rows) * len(times[:MOST_STILLS])} stills stand in `report.html`.",
    )


def _view(motion: Motion) -> str:
    """A planar motion is seen from the side, a spatial one from a corner."""
    across = motion.runs[0].poses[:, :, 1]
    return "side" if float(np.abs(across - across[0]).max(initial=0.0)) < FLAT else "corner"


def _history(motion: Motion, k: int) -> Figure:
    history = motion.histories[k]
    peaks = {label: float(np.max(values)) for label, values in history.series.items()}
    said = ", ".join(f"{label} {number(v, 4)}" for label, v in peaks.items())
    unit = "" if history.unit == "1" else f" {history.unit}"
    limit = "" if history.limit is None else " The dotted line is the limit."
    beyond = [label for label, v in peaks.items() if v > history.drawn_to]
    if beyond:
        limit += f" The drawing ends at {number(history.drawn_to, 3)}{unit}; {names_of(beyond)} goes beyond."
    rows = np.unique(
        np.linspace(0, len(motion.times) - 1, min(MOST_ROWS, len(motion.times))).round().astype(int)
    )
    return Figure(
        id=f"history-{k + 1}",
        title=f"{history.name[:1].upper()}{history.name[1:]} over time",
        alt=f"{history.name} over {number(float(motion.times[-1]), 3)} s; largest values: {said}.",
        read_off=f"Largest values: {said}{unit}.{limit}",
        panels=(
            Panel(draw=lambda ax: plot_history(history, times=motion.times, ax=ax), width=6.0, height=2.6),
        ),
        table=Table(
            id=f"history-{k + 1}",
            title=f"{history.name} over time",
            columns=(
                Column(name="time", unit="s"),
                *(Column(name=label, unit=history.unit) for label in history.series),
            ),
            rows=tuple(
                (float(motion.times[i]), *(float(v[i]) for v in history.series.values())) for i in rows
            ),
        ),
    )

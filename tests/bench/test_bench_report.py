"""What a report costs: CPU seconds and bytes of a page with every section, and of one still.

The peer of a still is matplotlib's 3-D axes drawing the same bodies as lines of one pixel, which is less than
what the still shows.
"""

import time

import numpy as np
import pytest

from tests.sample_campaign import write_loop, write_sample
from tests.sample_motion import sample_motion
from workbench.motion.stills import png, still
from workbench.report.writing import write_report


def seconds(work, repeats=3):
    found = []
    for _ in range(repeats):
        start = time.process_time()
        result = work()
        found.append(time.process_time() - start)
    return min(found), result


@pytest.mark.bench
def test_report_and_stills(tmp_path):
    folder = write_sample(tmp_path / "sample.holdfast")
    plain, page = seconds(lambda: write_report(folder))
    size = page.stat().st_size
    write_loop(folder)
    loop, page = seconds(lambda: write_report(folder), repeats=1)
    print(f"\nreport: {plain:.2f} s CPU, {size / 1e3:.0f} kB; with layout, robust and motion: {loop:.2f} s, "
          f"{page.stat().st_size / 1e3:.0f} kB")  # fmt: skip
    motion = sample_motion()
    ours, picture = seconds(lambda: still(motion, run=1, time=0.9, width=640, height=400))
    print(f"still 640 x 400, 4 rays a pixel: {ours:.2f} s CPU, {len(png(picture)) / 1e3:.0f} kB")
    print(f"matplotlib 3-D lines, 640 x 400: {seconds(lambda: peer(motion))[0]:.2f} s CPU, no surfaces")
    assert page.stat().st_size < 2_000_000


def peer(motion):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    ax = figure.add_subplot(projection="3d")
    run = motion.runs[1]
    for place in run.poses[45, :, :3]:
        ax.plot(*np.stack([place, place + np.array([0, 0, 0.2])]).T)
    for a, b in run.segments(45):
        ax.plot(*np.stack([a, b]).T)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())

"""Kernels are compiled by processes beside a campaign that makes its design and its first runs.

An installation compiles once: some fifteen seconds for a Kriging, twenty for an adjoint of the engine, ten
for the bytecode of what draws a report. Each is one core's work, and would come when its stage has nothing
else to do. What is compiled is kept on disk, so that the stage finds it there, or does itself what is missing
of it.

What the first stages wait for has their priority: forward runs of the engine and a Kriging. The adjoint
stands back, and the bill of materials and the report furthest: idle cores are found for them until the loop
ends.
"""

import gc
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.stages.up_to_date import settled
from workbench.study.loading import load_study
from workbench.study.record import Study
from workbench.workers.processes import usable_processors

__all__ = ["compiled_ahead", "jobs_ahead"]

REPORT, KRIGING, LAYOUT = "report", "kriging", "layout"
LATER, LAST = 10, 19  # how far what is not needed at once stands back (`nice`)


@contextmanager
def compiled_ahead(campaign: CampaignRuns) -> Iterator[None]:
    """Compile what later stages of a study need while the block works; what is not done at its end is left.

    Nothing is started where that is compiled by now, for a study that asks for one process alone, or where
    every stage is done: that is told without a look at kernels, since numba takes two seconds to load.
    """
    beside: list[subprocess.Popen[bytes]] = []
    try:
        for job in [] if settled(campaign) is not None else jobs_ahead(campaign.study):
            beside.append(_started(job, campaign.study))
        yield
    finally:
        for process in beside:
            process.terminate()
            process.wait()


def jobs_ahead(study: Study) -> Iterator[str]:
    """What there is to compile ahead: of the report, of a Kriging, of the layout model.

    The first is told before the others are looked at, which loads numba: a core has nothing to do meanwhile.
    """
    alone = study.evaluate.get("engine") == "inline" or study.evaluate.get("workers", 1) == 1
    if study.path is None or alone or usable_processors() == 1:
        return
    if not is_report_compiled():
        yield REPORT
    if study.screen or study.worst_case:
        from surrogates import are_kernels_compiled

        if not are_kernels_compiled():
            yield KRIGING
    if study.robust_layout:
        from workbench.engine.sensitivity.compiled_before import an_adjoint_is_compiled

        if not an_adjoint_is_compiled():
            yield LAYOUT


def is_report_compiled() -> bool:
    """Whether the bytecode of what draws a report is kept by now, or cannot be."""
    drawing = find_spec("matplotlib")
    kept = None if drawing is None or sys.dont_write_bytecode else drawing.cached
    return kept is None or Path(kept).exists()


def _started(job: str, study: Study) -> "subprocess.Popen[bytes]":
    """The process of a job: away from the terminal's Ctrl-C, which is the campaign's, and silent.

    Whatever stops it will stop the stage itself, which says so. In a session of its own it would not stand
    back: Linux shares cores among sessions first, and priorities count within one.
    """
    nothing = subprocess.DEVNULL
    return subprocess.Popen(
        [sys.executable, "-m", __name__, job, str(study.path)],
        stdin=nothing, stdout=nothing, stderr=nothing, process_group=0,
    )  # fmt: skip


def _stand_back(by: int) -> None:
    """Leave the cores to what has a priority above `by`, which grows only; Windows has no such number."""
    if sys.platform != "win32":
        os.nice(max(by - os.nice(0), 0))


def compile_report() -> None:
    """Load all that a report is made with, and draw a line: Python keeps the bytecode."""
    import jinja2  # noqa: F401

    import workbench.report.writing  # noqa: F401
    from workbench.report.page.drawing import draw_svg

    draw_svg(lambda axes: axes.plot([0.0, 1.0]), width=2.0, height=1.0, name="line")


def compile_layout(study: Study, table: Mapping[str, Any]) -> None:
    """Run the layout model of `[robust_layout]` in its nominal case, take one step of the optimiser, and make
    a bill of materials; the process stands back behind the first run and further behind the step.

    A model that cannot run many cases in this process may call another code, whose runs cost: it is left be.
    """
    import numpy as np

    from workbench.engine.layout.optimise import optimise_layout
    from workbench.robust_layout.bill import layout_bill
    from workbench.robust_layout.model import load_layout_model

    model: Any = load_layout_model(table["model"], table["options"], folder=study.folder)
    many = getattr(model, "responses_of_cases", None)
    if not callable(many):
        return
    nominal = study.space.canonical(table["nominal"])
    many(np.zeros(model.members), [nominal], threads=1)
    _stand_back(LATER)
    problem = model.problem([nominal])
    optimise_layout(problem, max_evaluations=2, compare=False, probes=0)
    _stand_back(LAST)
    layout_bill(problem, np.ones(model.members))  # of members that are there


def main(job: str, path: str) -> None:
    """Do one job of `jobs_ahead`.

    Cyclic garbage is left lying: a compiler makes millions of objects and few in cycles, and looking through
    them takes a tenth of its time.
    """
    gc.disable()
    if job == REPORT:
        _stand_back(LAST)
        compile_report()
        return
    if job == KRIGING:
        from surrogates import compile_kernels

        compile_kernels()
        return
    study = load_study(Path(path))
    if study.robust_layout is not None:
        compile_layout(study, study.robust_layout)


if __name__ == "__main__":
    main(*sys.argv[1:])

"""The command line: a thin shell over the functions that a notebook calls too.

Exit codes: 0 done, 2 a file or argument is not usable, 3 done with failed evaluations, 4 interrupted and
resumable, 5 the store failed. With --json the figures go to standard output and everything else to standard
error. Nothing heavy is imported before a command needs it.
"""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.errors import HoldfastError, Interrupted, StudyError
from workbench.sampling.kinds import KINDS

if TYPE_CHECKING:
    from workbench.stages.campaign import Campaign

__all__ = ["app", "main"]

app = typer.Typer(
    help="Which uncertain parameters matter, where the worst case lies, which layout holds fast in it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

StudyFile = Annotated[Path, typer.Argument(help="The study file, such as study.toml.", metavar="STUDY")]
Folder = Annotated[Path | None, typer.Option(help="The campaign's folder [default: STUDY.holdfast].")]
Json = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Worker processes [default: the study's].")]
Dask = Annotated[str | None, typer.Option(help="Run on the Dask cluster at this address, tcp://...")]
KeepRuns = Annotated[bool, typer.Option(help="Keep stored runs although the model's source changed.")]
Retry = Annotated[bool, typer.Option(help="Try failed runs again.")]

OK, FAILED_RUNS, INTERRUPTED = 0, 3, 4
STOPPED = "interrupted; the same command continues"


@app.command()
def run(
    study: StudyFile,
    folder: Folder = None,
    workers: Workers = None,
    dask: Dask = None,
    keep_runs: KeepRuns = False,
    retry_failed: Retry = False,
    json_: Json = False,
) -> None:
    """Walk all stages of a study; run it again to continue where it stopped."""
    with _campaign(study, folder, workers=workers, dask=dask, keep_runs=keep_runs) as campaign:
        if retry_failed:
            campaign.progress.note(f"{campaign.retry()} failed runs are tried again")
        found = campaign.run()
        failures = campaign.failures()
    _finish(found, json_, lambda: _tell_run(found), failures)


@app.command()
def design(
    study: StudyFile,
    folder: Folder = None,
    csv: Annotated[
        Path | None, typer.Option(help="Write the rows to run, with their keys, to this CSV.")
    ] = None,
    quality: Annotated[
        bool, typer.Option("--quality", help="All figures of merit, and design_quality.png in the folder.")
    ] = False,
    compare: Annotated[
        str | None, typer.Option(help=f"Other kinds to put beside it, such as lhs,ihs: {', '.join(KINDS)}.")
    ] = None,
    json_: Json = False,
) -> None:
    """Make the design and put its rows in the queue; list the rows that somebody else is to run."""
    from workbench.campaign.telling import asked_csv, asked_lines, asked_rows
    from workbench.report.lines.design import comparison_lines, design_lines
    from workbench.stages.design import compared_designs, drawn_design
    from workbench.stages.run_all import design as stage
    from workbench.stages.run_all import queue_design
    from workbench.system.atomic import write_text

    with _campaign(study, folder) as campaign:
        document = stage(campaign) if campaign.study.has_points else None
        if document is None and (quality or compare is not None):
            raise StudyError("--quality and --compare look at a design; give the study a [design] table")
        asked = asked_rows(campaign) if document is None else queue_design(campaign, document)
        if csv is not None:
            text = asked_csv(asked, campaign.study.space.names, list(campaign.study.reductions))
            write_text(csv, text)
        where = campaign.folder
        others = compared_designs(document, compare.split(",")) if document and compare else None
        listed = (
            asked_lines(asked, study=str(study), csv=csv) if campaign.study.model["kind"] == "ask" else []
        )
    if document is None:
        rows = [{"key": run.key, "parameters": dict(run.parameters)} for run in asked]
        lines = [f"no [design] table; {len(asked)} runs asked for by a search wait for their results"]
        lines += [f"written to {csv}"] if csv else []
        _finish({"asked": rows}, json_, lambda: _print([*lines, *listed]))
        return
    what = f"{document['n']} runs of {document['d']} parameters ({document['algorithm']})"
    lines = [f"{what}, {len(asked)} without an answer"]
    lines += design_lines(document, whole=quality) if others is None else comparison_lines(others)
    if quality:
        lines.append(f"pairs, correlations and distances drawn in {drawn_design(document, where)}")
    lines.append(f"written to {csv or where / 'design.json'}")
    _finish(document, json_, lambda: _print([*lines, *listed]))


@app.command()
def tell(
    study: StudyFile,
    results: Annotated[Path, typer.Argument(help="A CSV of results.")],
    folder: Folder = None,
    json_: Json = False,
) -> None:
    """Take results that were made elsewhere: a CSV with keys or parameters, and responses."""
    from dataclasses import asdict

    from workbench.campaign.telling import tell_csv

    with _campaign(study, folder) as campaign:
        told = tell_csv(campaign, results)
        left = len(campaign.ask())
    document = {**asdict(told), "waiting": left}
    line = (
        f"{told.answered} runs answered, {told.new} new, {told.repeated} known already, {told.failed} failed"
    )
    line += f"; {left} still wait"
    _finish(document, json_, lambda: _print([line]))


@app.command()
def screen(
    study: StudyFile,
    folder: Folder = None,
    method: Annotated[
        str | None,
        typer.Option(help="Look again by another method: default, forward, welch, rivals, morris or hybrid."),
    ] = None,
    trajectories: Annotated[int, typer.Option(min=1, help="Of Morris, each d + 1 runs.")] = 4,
    json_: Json = False,
) -> None:
    """Which parameters matter, from the runs that are stored."""
    from workbench.report.lines.screening import screening_lines
    from workbench.stages.run_all import screen as stage

    if method is not None:
        from workbench.report.lines.screening import other_screening_lines
        from workbench.stages.other_screenings import other_screening

        with _campaign(study, folder) as campaign:
            other = other_screening(campaign, method, trajectories=trajectories)
        _finish(other, json_, lambda: _print(other_screening_lines(other)))
        return
    with _campaign(study, folder) as campaign:
        document = stage(campaign)
    _finish(document, json_, lambda: _print(screening_lines(document)))


@app.command("worst-case")
def worst_case(study: StudyFile, folder: Folder = None, workers: Workers = None, json_: Json = False) -> None:
    """Where the worst case lies; every candidate is confirmed by a true run."""
    from workbench.report.lines.worst_case import worst_case_lines
    from workbench.stages.run_all import worst_case as stage

    with _campaign(study, folder, workers=workers) as campaign:
        document = stage(campaign)
        failures = campaign.failures()
    _finish(document, json_, lambda: _print(worst_case_lines(document)), failures)


@app.command()
def layout(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
    """Optimise the layout of the study's multibody problem; run it again to continue."""
    from workbench.report.lines.layout import layout_lines
    from workbench.stages.run_all import layout as stage

    with _campaign(study, folder) as campaign:
        document = stage(campaign)
    _finish(document, json_, lambda: _print(layout_lines(document)))


@app.command()
def robust(study: StudyFile, folder: Folder = None, workers: Workers = None, json_: Json = False) -> None:
    """Compare designs over the whole uncertainty, at the same points."""
    from workbench.report.lines.robust import robust_lines
    from workbench.stages.run_all import robust as stage

    with _campaign(study, folder, workers=workers) as campaign:
        document = stage(campaign)
        failures = campaign.failures()
    _finish(document, json_, lambda: _print(robust_lines(document)), failures)


@app.command("robust-layout")
def robust_layout(
    study: StudyFile, folder: Folder = None, workers: Workers = None, json_: Json = False
) -> None:
    """Layout for the worst cases, worst case of that layout, in turn; run it again to continue."""
    from workbench.report.lines.robust_layout import robust_layout_lines
    from workbench.stages.run_all import robust_layout as stage

    with _campaign(study, folder, workers=workers) as campaign:
        document = stage(campaign)
    _finish(document, json_, lambda: _print(robust_layout_lines(document)))


@app.command()
def report(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
    """Write the report and the exports of what the folder holds."""
    from workbench.report.writing import report_numbers
    from workbench.stages.run_all import report as stage

    with _campaign(study, folder) as campaign:
        path = stage(campaign)
        numbers = report_numbers(campaign.folder) if json_ else {}
    _finish({"report": str(path), **numbers}, json_, lambda: _print([f"report: {path}"]))


@app.command()
def validate(
    study: Annotated[Path | None, typer.Argument(help="The study file.", metavar="STUDY")] = None,
    schema: Annotated[bool, typer.Option(help="Print the JSON schema of study files, for editors.")] = False,
    json_: Json = False,
) -> None:
    """Check a study file and its model without running anything."""
    from workbench.stages.validation import check_study
    from workbench.study.loading import json_schema, load_study

    if schema:
        print(json.dumps(json_schema(), indent=1))
        return
    if study is None:
        raise typer.BadParameter("give a study file, or --schema")
    found = check_study(load_study(study))
    _finish(found, json_, lambda: _print([f"{study.name} is valid: {found['summary']}"]))


@app.command()
def plan(
    study: Annotated[Path | None, typer.Argument(help="The study file.", metavar="[STUDY]")] = None,
    folder: Folder = None,
    factors: Annotated[
        int | None, typer.Option(min=1, help="How many runs does a screening of so many parameters need?")
    ] = None,
    actives: Annotated[int | None, typer.Option(min=1, help="About how many matter [default: 6].")] = None,
    noise: Annotated[
        float, typer.Option(min=0.0, help="Standard deviation of the noise over that of the response.")
    ] = 0.0,
    target: Annotated[float, typer.Option(help="Share of screenings that should be exactly right.")] = 0.9,
    trials: Annotated[int, typer.Option(min=1, help="Simulated screenings per number of runs.")] = 20,
    json_: Json = False,
) -> None:
    """What `run` would do: stages, runs, runs already made, and how long that takes at the pace so far.

    With --factors: how many runs to plan for a screening, by simulation.
    """
    if factors is not None:
        from workbench.screening.run_planning import plan_runs, run_plan_lines

        active = min(6, factors) if actives is None else actives
        found = plan_runs(factors, active, noise=noise, target=target, trials=trials).to_dict()
        _finish(found, json_, lambda: _print(run_plan_lines(found)))
        return
    if study is None:
        raise typer.BadParameter("give a study file, or --factors for the runs of a screening")
    from workbench.stages.planning import plan_lines, plan_study
    from workbench.study.loading import load_study

    document = plan_study(load_study(study), folder)
    _finish(document, json_, lambda: _print(plan_lines(document)))


@app.command()
def failures(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
    """Which runs gave no value, why, and where in the input space they sit."""
    from workbench.campaign.failures import failure_document, failure_lines

    with _campaign(study, folder) as campaign:
        document = failure_document(campaign.runs(), campaign.study.space)
    _finish(document, json_, lambda: _print(failure_lines(document)))


@app.command()
def export(
    study: StudyFile,
    folder: Folder = None,
    parquet: Annotated[bool, typer.Option(help="Also write runs.parquet (needs pyarrow).")] = False,
    json_: Json = False,
) -> None:
    """Write all runs as CSV and netCDF."""
    from workbench.campaign.exports import write_all

    with _campaign(study, folder) as campaign:
        paths = write_all(campaign, parquet=parquet)
    _finish([str(p) for p in paths], json_, lambda: _print([str(p) for p in paths]))


@app.command()
def watch(
    study: StudyFile,
    folder: Folder = None,
    every: Annotated[int, typer.Option(min=1, help="Seconds between looks.")] = 2,
    once: Annotated[bool, typer.Option(help="Look once.")] = False,
    page: Annotated[Path | None, typer.Option(help="Write a page that reloads itself to this file.")] = None,
    json_: Json = False,
) -> None:
    """Look at a campaign while it runs elsewhere; ends when nothing is left to run."""
    import time

    from workbench.study.loading import load_study
    from workbench.terminal.watching import state, state_lines, write_page

    place = folder or load_study(study).campaign_folder
    while True:
        found = state(place)
        if page is not None:
            write_page(page, found, every=every)
        _finish(found, json_, lambda now=found: _print(state_lines(now)))  # type: ignore[misc]
        if once or not found["left"]:
            return
        time.sleep(every)


@app.command()
def doctor(json_: Json = False) -> None:
    """Check this installation: versions, packages of the same name, workers, disk."""
    from workbench.terminal.doctor import examine

    found = examine()
    _finish(found.to_dict(), json_, lambda: _print(found.lines()))
    if not found.healthy:
        raise typer.Exit(2)


@app.command()
def demo(
    folder: Annotated[Path, typer.Option(help="Where to put the study and its campaign.")] = Path(
        "holdfast-demo"
    ),
    study: Annotated[str, typer.Option(help="Which shipped study: occupant or welch20.")] = "occupant",
    json_: Json = False,
) -> None:
    """Run a shipped study from design to report."""
    from workbench.stages.demonstration import copy_study

    with _campaign(copy_study(folder, study), None) as campaign:
        found = campaign.run()
        failures = campaign.failures()
    _finish(found, json_, lambda: _tell_run(found), failures)


def main() -> None:
    """The console command."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        # matrices of a few hundred rows: threads cost more than they give, and workers have the other cores
        os.environ.setdefault(name, "1")
    # not the handler of SIGINT: that is "ignore" in the background of a script, where SIGTERM means stop
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        app()
    except HoldfastError as exc:
        _fail(str(exc), exc.exit_code)
    except KeyboardInterrupt:
        _fail(STOPPED, INTERRUPTED)
    except SystemExit as exc:
        if _was_interrupted(exc):
            _fail(STOPPED, INTERRUPTED)
        raise
    except BrokenPipeError:
        sys.stderr.close()
        raise SystemExit(OK) from None


def _was_interrupted(exc: BaseException) -> bool:
    """Whether Ctrl-C or SIGTERM stands behind it: typer takes a KeyboardInterrupt and leaves with a code."""
    behind = exc.__context__
    return behind is not None and (isinstance(behind, KeyboardInterrupt) or _was_interrupted(behind))


def _fail(text: str, code: int) -> None:
    if "--json" in sys.argv:
        print(json.dumps({"error": text, "exit_code": code}))
    print(f"holdfast: {text}", file=sys.stderr)
    raise SystemExit(code)


@contextmanager
def _campaign(
    study: Path,
    folder: Path | None,
    *,
    workers: int | None = None,
    dask: str | None = None,
    keep_runs: bool = False,
) -> Iterator["Campaign"]:
    """The campaign of a study with progress on standard error."""
    from workbench.stages.campaign import Campaign
    from workbench.terminal.console import progress_for

    progress = progress_for(sys.stderr)
    try:
        with Campaign.from_file(
            study, folder=folder, workers=workers, dask=dask, keep_runs=keep_runs, progress=progress
        ) as campaign:
            yield campaign
    except Interrupted:
        progress.finished()
        raise
    finally:
        progress.finished()


def _finish(
    document: Any, as_json: bool, tell_it: Callable[[], None], failures: dict[str, int] | None = None
) -> None:
    """Print the figures, and leave with 3 when runs failed."""
    if as_json:
        print(json.dumps(document, indent=1, sort_keys=True))
    else:
        tell_it()
    if failures:
        text = ", ".join(f"{n} {status}" for status, n in failures.items())
        print(f"holdfast: runs without a value: {text} (see `holdfast failures`)", file=sys.stderr)
        raise typer.Exit(FAILED_RUNS)


def _tell_run(found: dict[str, Any]) -> None:
    from workbench.report.lines.study import run_lines

    _print(run_lines(found))


def _print(lines: list[str]) -> None:
    print("\n".join(lines))

"""The commands that walk a study: all stages, each stage, results told from outside, the report."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from workbench.errors import StoreError, StudyError
from workbench.sampling.kinds import KINDS
from workbench.stages.table import STAGES, Stage, stage_named
from workbench.terminal.looking import viewed_campaign, writable_place
from workbench.terminal.shared import (
    AtBaseline,
    Dask,
    Folder,
    Json,
    NewVersion,
    Output,
    Retry,
    RunAgain,
    SameModel,
    StudyFile,
    Workers,
    finish,
    opened_campaign,
)

__all__ = ["commands"]

commands = typer.Typer()


@commands.command()
def run(
    study: StudyFile,
    folder: Folder = None,
    workers: Workers = None,
    dask: Dask = None,
    same_model: SameModel = False,
    new_version: NewVersion = False,
    run_again: RunAgain = False,
    at_baseline: AtBaseline = False,
    retry_failed: Retry = False,
    json_: Json = False,
) -> None:
    """Walk all stages of a study. Run it again to continue where it stopped."""
    from workbench.campaign.permissions import Permissions
    from workbench.space.units import counted
    from workbench.stages.run_all import run_lines
    from workbench.terminal.compiling_ahead import compiled_ahead

    allowed = Permissions(
        same_model=same_model, new_version=new_version, run_again=run_again, at_baseline=at_baseline
    )
    with opened_campaign(
        study, folder, workers=workers, dask=dask, permissions=allowed, all_stages=True
    ) as campaign:
        if retry_failed:
            again = counted(campaign.retry(), "failed run is", "failed runs are")
            campaign.progress.note(f"{again} tried again")
        with compiled_ahead(campaign):
            found = campaign.run()
    finish(found, run_lines(found), as_json=json_, failures=found["failures"])


@commands.command(help=stage_named("design").help)
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
    from workbench.campaign.telling import asked_csv, asked_lines, asked_rows
    from workbench.report.lines.design import comparison_lines, design_lines
    from workbench.space.units import counted
    from workbench.stages.design import compared_designs, drawn_design, queue_design, waiting_rows
    from workbench.stages.run_all import run_stage
    from workbench.system.atomic import write_text

    with opened_campaign(study, folder) as campaign:
        document = run_stage(campaign, "design") if campaign.study.has_points else None
        if document is None and (quality or compare is not None):
            raise StudyError("--quality and --compare look at a design; give the study a [design] table")
        by_others = campaign.study.model["kind"] == "ask"
        waits = 0 if document is None else queue_design(campaign, document)
        if document is None:
            asked = asked_rows(campaign)
        else:  # very many rows are only held for those who run them elsewhere
            asked = waiting_rows(campaign) if by_others or csv is not None else []
        if csv is not None:
            text = asked_csv(asked, campaign.study.space.names, list(campaign.study.reductions))
            write_text(csv, text)
        where = campaign.folder
        others = compared_designs(document, where, compare.split(",")) if document and compare else None
        listed = asked_lines(asked, study=str(study), csv=csv) if by_others else []
    if document is None:
        rows = [{"key": run.key, "parameters": dict(run.parameters)} for run in asked]
        wait = counted(len(asked), "run that a search asked for waits", "runs that a search asked for wait")
        lines = [f"no [design] table; {wait} for results"]
        lines += [f"written to {csv}"] if csv else []
        finish({"asked": rows}, [*lines, *listed], as_json=json_)
        return
    size = f"{counted(document['n'], 'run')} of {counted(document['d'], 'parameter')}"
    what = f"{size} ({document['algorithm']})"
    lines = [f"{what}, {len(asked) or waits} without an answer"]
    lines += design_lines(document, whole=quality) if others is None else comparison_lines(others)
    if quality:
        lines.append(f"pairs, correlations and distances drawn in {drawn_design(document, where)}")
    lines.append(f"written to {csv or where / 'design.json'}")
    finish(document, [*lines, *listed], as_json=json_)


@commands.command()
def tell(
    study: StudyFile,
    results: Annotated[Path, typer.Argument(help="A CSV of results.")],
    folder: Folder = None,
    json_: Json = False,
) -> None:
    """Take results that were made elsewhere. A CSV with keys or parameters, and responses."""
    from dataclasses import asdict

    from workbench.campaign.telling import tell_csv
    from workbench.models.table import ignored_sentence
    from workbench.report.lines.tables import wrapped
    from workbench.space.units import counted

    with opened_campaign(study, folder) as campaign:
        told = tell_csv(campaign, results)
        left = len(campaign.ask())
    document = {**asdict(told), "waiting": left}
    line = (
        f"{counted(told.answered, 'run')} answered, {told.new} told unasked, {told.repeated} known already, "
        f"{told.failed} failed"
    )
    line += f"; {left} still {'waits' if left == 1 else 'wait'}"
    said = [] if not told.ignored else wrapped(ignored_sentence(told.ignored, results.name), 79)
    finish(document, [line, *said], as_json=json_)


@commands.command()
def reread(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
    """Read the responses of stored runs again. From what they left; nothing is run."""
    from workbench.space.units import counted

    with opened_campaign(study, folder) as campaign:
        found = campaign.reread(every=True)
    document = {"read": found.read, "stored": found.looked_at}
    finish(document, [f"{found.read} of {counted(found.looked_at, 'stored run')} read again"], as_json=json_)


@commands.command(help=stage_named("screen").help)
def screen(
    study: Annotated[
        Path | None,
        typer.Argument(help="The study file, such as study.toml; not for `--method list`.", metavar="STUDY"),
    ] = None,
    folder: Folder = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="Look again by another method: default, forward, welch, rivals, sobol, src, srrc, pcc, "
            "prcc, hsic, morris or hybrid; `list` says what each needs and cannot see."
        ),
    ] = None,
    response: Annotated[
        str | None, typer.Option(help="Look at another response than that of the [screen] table.")
    ] = None,
    trajectories: Annotated[int, typer.Option(min=1, help="Of Morris, each d + 1 runs.")] = 4,
    json_: Json = False,
) -> None:
    """The stage `screen`, or a look at the same runs by another method."""
    from workbench.report.lines.screening import method_lines, other_screening_lines

    if method == "list":
        from workbench.screening.named_methods import NAMED_METHODS

        listed = {"methods": [asdict(one) for one in NAMED_METHODS]}
        finish(listed, method_lines(NAMED_METHODS), as_json=json_)
        return
    if study is None:
        raise StudyError("screen needs a study file, such as: holdfast screen study.toml")
    if method is None and response is None:
        _screen(study, folder, as_json=json_)
        return
    from workbench.stages.other_screenings import other_screening
    from workbench.stages.run_all import take_table

    with opened_campaign(study, folder) as campaign:
        take_table(campaign)
        other = other_screening(campaign, method, response=response, trajectories=trajectories)
    finish(other, other_screening_lines(other), as_json=json_)


def _screen(study: Path, folder: Path | None, *, as_json: bool) -> None:
    """The stage `screen`; of a campaign that others work on, or may write alone, nothing is written."""
    from workbench.stages.run_all import run_stage
    from workbench.stages.screen import screening_document

    stage = stage_named("screen")
    try:
        with opened_campaign(study, folder) as campaign:
            document = run_stage(campaign, stage.name)
    except StoreError:
        with viewed_campaign(study, folder) as view:
            if view.study.screen is None:
                raise
            document = screening_document(view, view.study.screen)
            view.progress.note("screening.json is left as it is: this is a look at the runs stored so far")
    finish(document, stage.work.lines(document), as_json=as_json)


def _run_stage(
    stage: Stage, study: Path, folder: Path | None, *, as_json: bool, workers: int | None = None
) -> None:
    """Run one stage, whether or not its document is there, and print what it found."""
    from workbench.stages.run_all import run_stage

    with opened_campaign(study, folder, workers=workers, runs_model=stage.runs_model) as campaign:
        document = run_stage(campaign, stage.name)
        failures = campaign.failures() if stage.runs_model else None
    finish(document, stage.work.lines(document), as_json=as_json, failures=failures)


def _add_command(stage: Stage) -> None:
    """The command of a stage without options of its own."""

    def command(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
        _run_stage(stage, study, folder, as_json=json_)

    def shared_command(
        study: StudyFile, folder: Folder = None, workers: Workers = None, json_: Json = False
    ) -> None:
        _run_stage(stage, study, folder, as_json=json_, workers=workers)

    commands.command(stage.command, help=stage.help)(shared_command if stage.workers else command)


for _stage in STAGES:
    if _stage.name not in ("design", "screen"):
        _add_command(_stage)


@commands.command()
def report(study: StudyFile, folder: Folder = None, output: Output = None, json_: Json = False) -> None:
    """Write the report and the exports of what the folder holds. Also while the campaign runs."""
    from workbench.report.writing import report_numbers
    from workbench.stages.run_all import outdated_sentence
    from workbench.stages.run_all import report as write

    with viewed_campaign(study, folder) as view:
        outdated = outdated_sentence(view)
        if outdated:
            view.progress.note(outdated)
        path = write(view, folder=writable_place(view.folder, output), outdated=outdated)
        numbers = report_numbers(view.folder) if json_ else {}
        looked = view.as_of.to_dict()
    finish(
        {"report": str(path), "as_of": looked, "outdated": outdated, **numbers},
        [f"report: {path}"],
        as_json=json_,
    )

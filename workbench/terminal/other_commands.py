"""The commands beside the stages: checks, plans, failures, exports, watching, the installation, the demo."""

import json
from pathlib import Path
from typing import Annotated

import typer

from workbench.terminal.looking import viewed_campaign, writable_place
from workbench.terminal.shared import Folder, Json, Output, StudyFile, finish, opened_campaign

__all__ = ["commands"]

commands = typer.Typer()

DAMAGED = 5  # the exit code of a store that is not sound


@commands.command()
def validate(
    study: Annotated[Path | None, typer.Argument(help="The study file.", metavar="STUDY")] = None,
    schema: Annotated[bool, typer.Option(help="Print the JSON schema of study files, for editors.")] = False,
    json_: Json = False,
) -> None:
    """Check a study file and its model without running anything."""
    from workbench.report.lines.tables import hanging
    from workbench.stages.validation import check_study
    from workbench.study.loading import json_schema, load_study

    if schema:
        print(json.dumps(json_schema(), indent=1))
        return
    if study is None:
        raise typer.BadParameter("give a study file, or --schema")
    found = check_study(load_study(study))
    notes = [line for said in found["notes"] for line in hanging("note: ", said, indent=2)]
    finish(found, [f"{study.name} is valid: {found['summary']}", *notes], as_json=json_)


@commands.command()
def verify(
    study: StudyFile,
    folder: Folder = None,
    sample: Annotated[int, typer.Option(min=1, help="How many stored runs to make once more.")] = 3,
    json_: Json = False,
) -> None:
    """Make some stored runs once more and compare. Ends with 2 when one comes out different."""
    from workbench.stages.validation import verification_lines, verify_runs

    with opened_campaign(study, folder) as campaign:
        found = verify_runs(campaign, sample)
    finish(found, verification_lines(found), as_json=json_)
    if found["different"]:
        raise typer.Exit(2)


@commands.command()
def plan(
    study: Annotated[Path | None, typer.Argument(help="The study file.", metavar="STUDY")] = None,
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
    """What `run` would do, and how long it takes. Stages, runs, runs already made, at the pace so far.

    With --factors: how many runs to plan for a screening, by simulation.
    """
    if factors is not None:
        from workbench.screening.run_planning import plan_runs, run_plan_lines

        active = min(6, factors) if actives is None else actives
        found = plan_runs(factors, active, noise=noise, target=target, trials=trials).to_dict()
        finish(found, run_plan_lines(found), as_json=json_)
        return
    if study is None:
        raise typer.BadParameter("give a study file, or --factors for the runs of a screening")
    from workbench.stages.planning import plan_lines, plan_study
    from workbench.study.loading import load_study

    document = plan_study(load_study(study), folder)
    finish(document, plan_lines(document), as_json=json_)


@commands.command()
def failures(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
    """Which runs gave no value, why, and where they sit."""
    from workbench.campaign.results.failures import failure_document, failure_lines

    with viewed_campaign(study, folder) as view:
        document = {**failure_document(view.runs(), view.study.space), "as_of": view.as_of.to_dict()}
    finish(document, failure_lines(document), as_json=json_)


@commands.command()
def export(
    study: StudyFile,
    folder: Folder = None,
    output: Output = None,
    parquet: Annotated[bool, typer.Option(help="Also write runs.parquet (needs pyarrow).")] = False,
    histories: Annotated[
        bool, typer.Option("--histories", help="Also write the time histories of all runs, histories.nc.")
    ] = False,
    raw: Annotated[
        bool, typer.Option("--raw", help="Leave texts that a spreadsheet takes for formulas as they are.")
    ] = False,
    json_: Json = False,
) -> None:
    """Write all runs as CSV and netCDF."""
    from workbench.campaign.results.exports import write_all

    with viewed_campaign(study, folder) as view:
        place = writable_place(view.folder, output)
        paths = write_all(view, folder=place, parquet=parquet, histories=histories, raw=raw)
    finish([str(p) for p in paths], [str(p) for p in paths], as_json=json_)


@commands.command()
def show(
    study: StudyFile,
    run: Annotated[str, typer.Argument(help="The number of a run, or the beginning of its key.")],
    folder: Folder = None,
    json_: Json = False,
) -> None:
    """All that is known of one run. Values, attempts, the state of the model, files, log."""
    from workbench.campaign.view import CampaignView
    from workbench.study.loading import load_study
    from workbench.terminal.showing import run_document, run_lines

    with CampaignView.opened(load_study(study), folder=folder) as view:
        found = run_document(view, run)
    finish(found, [*run_lines(found), found["as_of"]["sentence"]], as_json=json_)


@commands.command()
def watch(
    study: StudyFile,
    folder: Folder = None,
    every: Annotated[int, typer.Option(min=1, help="Seconds between looks.")] = 2,
    once: Annotated[bool, typer.Option(help="Look once.")] = False,
    page: Annotated[Path | None, typer.Option(help="Write a page that reloads itself to this file.")] = None,
    json_: Json = False,
) -> None:
    """Look at a campaign while it runs elsewhere. Ends when nothing is left to run."""
    import time

    from workbench.study.loading import load_study
    from workbench.terminal.watching import state, state_lines, write_page

    place = folder or load_study(study).campaign_folder
    while True:
        found = state(place)
        if page is not None:
            write_page(page, found, every=every)
        finish(found, state_lines(found), as_json=json_)
        if once or not found["left"]:
            return
        time.sleep(every)


@commands.command()
def doctor(
    model: Annotated[
        Path | None, typer.Option(help="List what the state of this study's model consists of instead.")
    ] = None,
    store: Annotated[
        Path | None, typer.Option(help="Examine the store of this study, or of this folder, instead.")
    ] = None,
    json_: Json = False,
) -> None:
    """Check this installation. Versions, packages of the same name, workers, disk."""
    if store is not None:
        from workbench.campaign.rescue.examination import DATABASES, examined, examined_histories
        from workbench.study.loading import load_study

        place = store if store.is_dir() else load_study(store).campaign_folder
        states = [examined(place / name) for name in DATABASES if (place / name).exists()]
        states = states or [examined(place / DATABASES[0])]
        histories = examined_histories(place)
        states += [] if histories is None else [histories]
        lines = [line for state in states for line in state.lines()]
        finish([state.to_dict() for state in states], lines, as_json=json_)
        if not all(state.is_sound for state in states):
            raise typer.Exit(DAMAGED)
        return
    if model is not None:
        from workbench.provenance.content import ContentCache
        from workbench.provenance.state import model_state
        from workbench.study.loading import load_study

        read = load_study(model)
        spec = read.spec(version=str(read.model.get("version", "")))
        state = model_state(spec, read.model.get("state") or {}, cache=ContentCache(None))
        lines = ["a change of these is asked about ([model.state] includes and excludes):"]
        lines += [f"  {name}" for name in state.decides]
        lines += ["written down with every run:", *(f"  {n} {v}" for n, v in state.circumstances.items())]
        finish({**state.to_dict(), "digest": state.digest}, lines, as_json=json_)
        return
    from workbench.terminal.doctor import examine

    found = examine()
    finish(found.to_dict(), found.lines(), as_json=json_)
    if not found.healthy:
        raise typer.Exit(2)


@commands.command()
def recover(study: StudyFile, folder: Folder = None, json_: Json = False) -> None:
    """Make a new store of what can be read of a damaged one. Its log, runs.csv and results.nc are read."""
    from workbench.campaign.rescue.recovery import recovered, recovery_lines
    from workbench.study.loading import load_study

    read = load_study(study)
    found = recovered(read, folder or read.campaign_folder)
    finish([one.to_dict() for one in found], recovery_lines(found), as_json=json_)


@commands.command()
def merge(
    study: StudyFile,
    other: Annotated[Path, typer.Argument(help="The folder of the other campaign, such as b.holdfast.")],
    folder: Folder = None,
    json_: Json = False,
) -> None:
    """Take over the answers of another campaign. It stays as it is; the states of both models must agree."""
    from workbench.campaign.rescue.merging import merged, merging_lines

    with opened_campaign(study, folder) as campaign:
        found = merged(campaign, other)
        campaign.reread()
    finish(found.to_dict(), merging_lines(found, other), as_json=json_)


@commands.command()
def demo(
    folder: Annotated[Path, typer.Option(help="Where to put the study and its campaign.")] = Path(
        "holdfast-demo"
    ),
    study: Annotated[
        str, typer.Option(help="Which shipped study: occupant, welch20 or gunner.")
    ] = "occupant",
    json_: Json = False,
) -> None:
    """Run a shipped study from design to report."""
    from workbench.stages.run_all import run_lines
    from workbench.study.shipped import copy_study
    from workbench.terminal.compiling_ahead import compiled_ahead

    with opened_campaign(copy_study(folder, study), None) as campaign:
        with compiled_ahead(campaign):
            found = campaign.run()
        failures = campaign.failures()
    finish(found, run_lines(found), as_json=json_, failures=failures)

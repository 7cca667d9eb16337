"""What the commands share: their options, an opened campaign, and how figures are printed.

With --json the figures go to standard output and everything else to standard error. Nothing heavy is imported
before a command needs it.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.errors import Interrupted

if TYPE_CHECKING:
    from workbench.campaign.permissions import Permissions
    from workbench.stages.campaign import Campaign

__all__ = [
    "AtBaseline",
    "Dask",
    "Folder",
    "Json",
    "NewVersion",
    "Output",
    "Retry",
    "RunAgain",
    "SameModel",
    "StudyFile",
    "Workers",
    "finish",
    "opened_campaign",
]

StudyFile = Annotated[Path, typer.Argument(help="The study file, such as study.toml.", metavar="STUDY")]
Folder = Annotated[Path | None, typer.Option(help="The campaign's folder [default: STUDY.holdfast].")]
Json = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Worker processes [default: the study's].")]
Dask = Annotated[str | None, typer.Option(help="Run on the Dask cluster at this address, tcp://...")]
SameModel = Annotated[
    bool,
    typer.Option(
        "--same-model", "--keep-runs", help="The changed model gives the same results: stored runs serve on."
    ),
]
AtBaseline = Annotated[
    bool,
    typer.Option("--at-baseline", help="Runs made before a parameter was added were made at its baseline."),
]
NewVersion = Annotated[
    bool,
    typer.Option("--new-version", help="The model changed: make its runs anew, the old ones stay apart."),
]
RunAgain = Annotated[
    bool, typer.Option("--run-again", help="Make runs anew from which a response cannot be read.")
]
Output = Annotated[Path | None, typer.Option(help="Write into this folder [default: the campaign's folder].")]
Retry = Annotated[bool, typer.Option(help="Try failed runs again.")]

FAILED_RUNS = 3  # the exit code of work that is done, with runs that failed


@contextmanager
def opened_campaign(
    study: Path,
    folder: Path | None,
    *,
    workers: int | None = None,
    dask: str | None = None,
    permissions: "Permissions | None" = None,
    runs_model: bool = False,
    all_stages: bool = False,
) -> Iterator["Campaign"]:
    """The campaign of a study with progress on standard error.

    runs_model: the command has the model run, so the folder of a new campaign waits until it can be opened.
    all_stages: it walks all stages, so what `holdfast validate` refuses is refused before a run is spent.
    """
    from workbench.stages.campaign import Campaign
    from workbench.terminal.console import progress_for

    if all_stages:
        _check_all(study, folder, dask)
    elif runs_model and dask is None:
        _check_new(study, folder)
    progress = progress_for(sys.stderr)
    try:
        with Campaign.from_file(
            study, folder=folder, workers=workers, dask=dask, permissions=permissions, progress=progress
        ) as campaign:
            yield campaign
    except Interrupted:
        progress.finished()
        raise
    finally:
        progress.finished()


def _check_all(path: Path, folder: Path | None, dask: str | None) -> None:
    """Refuse what `holdfast validate` refuses, of the stages that are not done."""
    from workbench.stages.validation import check_before_runs
    from workbench.study.loading import load_study

    study = load_study(path)
    if dask is not None:
        study = replace(study, evaluate={**study.evaluate, "engine": "dask", "address": dask})
    check_before_runs(study, folder)


def _check_new(path: Path, folder: Path | None) -> None:
    """Refuse the model of a new campaign as `holdfast validate` does; that of a cluster may not be here."""
    from workbench.stages.validation import check_model
    from workbench.study.loading import load_study

    study = load_study(path)
    is_new = not ((folder or study.campaign_folder) / "runs.sqlite").exists()
    if is_new and study.evaluate.get("engine") != "dask":
        check_model(study)


def finish(
    document: Any, lines: Sequence[str], *, as_json: bool, failures: Mapping[str, int] | None = None
) -> None:
    """Print the figures, as lines or as JSON, and leave with 3 when runs failed."""
    if as_json:
        print(json.dumps(document, indent=1, sort_keys=True))
    else:
        print("\n".join(_for_a_terminal(lines) if sys.stdout.isatty() else lines))
    if failures:
        text = ", ".join(f"{n} {status}" for status, n in failures.items())
        print(f"holdfast: runs without a value: {text} (see `holdfast failures`)", file=sys.stderr)
        raise typer.Exit(FAILED_RUNS)


def _for_a_terminal(lines: Sequence[str]) -> list[str]:
    """Lines that go on below themselves where the terminal ends; files and pipes have them whole."""
    from workbench.report.lines.tables import fitted

    return fitted(lines, width=max(40, get_terminal_size().columns))

"""What a stage does, as a record: the file of each stage ends with one, named `WORK`."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from workbench.campaign.runs import CampaignRuns
    from workbench.campaign.view import StoredRuns
    from workbench.study.record import Study

__all__ = ["Work"]

Table = Mapping[str, Any]
Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """What a stage does.

    run: does the work its table asks for, writes the document and gives it.
    inputs: what decides the document beside the table, the seed, the space and the model, as text in pieces.
    lines: the document for a terminal.
    planned_runs: how many runs it may make, None where nobody can tell; None itself for a stage without runs.
    check: what can be told without running anything; raises StudyError.
    notes: what a checked table allows and is worth a word, in sentences without their full stops.
    """

    run: "Callable[[CampaignRuns, Table], dict[str, Any]]"
    inputs: "Callable[[StoredRuns, Table], Iterable[str]]"
    lines: Callable[[Document], list[str]]
    planned_runs: "Callable[[Study, Path], int | None] | None" = None
    check: "Callable[[Study], None] | None" = None
    notes: "Callable[[Study], list[str]] | None" = None

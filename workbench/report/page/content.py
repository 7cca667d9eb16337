"""What stands on a page, before it is written as HTML or Markdown."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from workbench.report.page.blocks import Card, Section

__all__ = ["Content", "Missing"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Missing:
    """A section without data, and the command that writes them."""

    title: str
    command: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Content:
    """A page: what was asked, the answers on the first screen, the sections, and those there are no data for.

    running: in words, when somebody works on the campaign while it is looked at; else empty.
    outdated: in words, when what the page shows was made before the study or its runs changed; else empty.
    version, seed, study_hash: of the programme and the study, "" or None where the folder does not tell.
    """

    title: str
    question: str
    cards: Sequence[Card]
    sections: Sequence[Section]
    missing: Sequence[Missing]
    version: str
    seed: Any
    study_hash: str
    running: str = ""
    outdated: str = ""

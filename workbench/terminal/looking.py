"""Campaigns that commands only look at: brought up to date where that is possible, else shown as they are."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.errors import HoldfastError, StoreError

if TYPE_CHECKING:
    from workbench.campaign.view import CampaignView

__all__ = ["viewed_campaign", "writable_place"]


@contextmanager
def viewed_campaign(study: Path, folder: Path | None) -> Iterator["CampaignView"]:
    """The campaign of a study to look at; as of when stands on standard error.

    Where nobody works on it and it can be written, its responses are first read as the study reads them now.
    Where that is impossible or refused, the runs are shown as they are stored, with the reason. Where no
    campaign is, none is made.
    """
    from workbench.campaign.view import CampaignView
    from workbench.stages.campaign import Campaign
    from workbench.study.loading import load_study
    from workbench.system.witness import witness_says
    from workbench.terminal.console import progress_for

    read = load_study(study)
    progress = progress_for(sys.stderr)
    try:
        refused = ""
        path = (folder or read.campaign_folder) / "runs.sqlite"
        if path.exists() or witness_says(path):
            try:
                Campaign(read, folder=folder, progress=progress).close()
            except HoldfastError as exc:
                refused = str(exc)
        with CampaignView.opened(read, folder=folder, progress=progress) as view:
            holder = view.as_of.holder
            if refused and holder is not None and holder.sentence in refused:
                progress.note(f"{view.as_of.sentence}; shown as stored")
            else:
                if refused:
                    progress.note(f"shown as stored: {refused}")
                progress.note(view.as_of.sentence)
            yield view
    finally:
        progress.finished()


def writable_place(folder: Path, output: Path | None) -> Path:
    """Where a look writes its files: `output`, made when new, or the campaign's folder.

    Raises:
        StoreError: the one that is meant cannot be written.
    """
    if output is None:
        if not os.access(folder, os.W_OK):
            raise StoreError(f"{folder} cannot be written from here; say where to with --output FOLDER")
        return folder
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise StoreError(f"cannot make the folder {output}: {exc.strerror}. Choose another --output") from exc
    return output

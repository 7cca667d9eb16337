"""A campaign: a study at work in its folder, from the first stage to the report.

    campaign = Campaign.from_file("study.toml")
    campaign.run()                                  # design -> evaluate -> screen -> worst case -> report
    campaign.results()                              # an xarray Dataset with units

Its runs (the folder, the store, `evaluate`, `ask`, `tell`) stand in `workbench.campaign.runs`, the walk
through the stages in `workbench.stages.run_all`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import numpy as np

from workbench.campaign.permissions import Permissions
from workbench.campaign.progress import Progress
from workbench.campaign.results.exports import dataset, frame
from workbench.campaign.runs import CampaignRuns
from workbench.histories.stack import stacked
from workbench.histories.stored import history_dataset
from workbench.space.box import Response, Space
from workbench.stages.run_all import run_all
from workbench.study.loading import load_study
from workbench.study.record import Study

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["Campaign"]


@final
class Campaign(CampaignRuns):
    """A study, its folder, its runs and its stages. Close it, or use it in a `with` statement."""

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        *,
        folder: str | Path | None = None,
        workers: int | None = None,
        dask: str | None = None,
        keep_runs: bool = False,
        permissions: Permissions | None = None,
        progress: Progress | None = None,
    ) -> Self:
        """Open or continue the campaign of a study file, in `folder` or beside the file.

        `permissions`: what is allowed where the study changed under its runs; `keep_runs` is same_model.

        Raises:
            StudyError: the file is not usable, or its model changed since runs were stored.
            StoreError: the folder cannot be used.
        """
        study = load_study(path)
        if workers is not None:
            study = replace(study, evaluate={**study.evaluate, "workers": workers})
        if dask is not None:
            study = replace(study, evaluate={**study.evaluate, "engine": "dask", "address": dask})
        place = None if folder is None else Path(folder)
        allowed = Permissions() if permissions is None else permissions
        allowed = replace(allowed, same_model=allowed.same_model or keep_runs)
        return cls(study, folder=place, permissions=allowed, progress=progress)

    @classmethod
    def of(
        cls,
        function: Callable[..., Any],
        space: Space,
        *,
        responses: Sequence[Response] = (Response("y"),),
        name: str = "campaign",
        folder: str | Path | None = None,
        seed: int = 1,
        version: str = "1",
        progress: Progress | None = None,
    ) -> Self:
        """A campaign of a Python function, run in this process; kept in `folder` or in `name`.holdfast here.

        `version`: change it when the function changes, and its runs are made anew.
        """
        reference = (
            f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', repr(function))}"
        )
        study = Study(
            name=name,
            seed=seed,
            space=space,
            responses=tuple(responses),
            reductions={r.name: None for r in responses},
            model={"kind": "python", "function": reference, "version": version},
            evaluate={"engine": "inline", "workers": 1, "retries": 0},
        )
        return cls(
            study, folder=None if folder is None else Path(folder), function=function, progress=progress
        )

    def run(self) -> dict[str, Any]:
        """Walk the stages that the study asks for; what is up to date stays. Gives what each found."""
        return run_all(self)

    def results(self) -> "xr.Dataset":
        """All runs as a Dataset over the dimension `run`, with units in the attributes."""
        return dataset(self.runs(), self.study.space, self.study.responses, name=self.study.name)

    def frame(self) -> "pd.DataFrame":
        """All runs as a table: key, status, batch, parameters, responses, error, seconds."""
        return frame(self.runs(), self.study.space, self.study.responses)

    def history(self, key: str) -> "xr.Dataset":
        """The time histories of a run."""
        return history_dataset(self.folder, key)

    def histories(self, name: str, *, time: "Sequence[float] | np.ndarray | None" = None) -> "xr.Dataset":
        """The time histories `name` of all runs with a value, over `run` and `time`; read when asked for.

        The parameters of the runs are coordinates. Where a run ended before the others, NaN follows. Runs on
        different times need the `time` that is wanted: values are then on the straight line between samples,
        NaN outside the time of a run.

        Raises:
            StudyError: there is no such history; the runs stand on different times and no `time` is given.
        """
        from workbench.histories.lazy import lazy_dataset

        runs = {row.key: row for row in self.runs() if row.status == "ok"}
        times = None if time is None else np.asarray(time, dtype=float)
        stack = stacked(self.folder, name, list(runs), times=times)
        parameters = dataset([runs[key] for key in stack.keys], self.study.space, (), name=self.study.name)
        found = lazy_dataset(stack)
        clash = [str(n) for n in parameters.data_vars if n in found.variables]
        return found.assign_coords(parameters.drop_vars(clash).variables).assign_attrs(parameters.attrs)

"""A run of the store that is worse than the worst case that is stated.

A worst case lies below no run that is known when its stage ends. Later stages run the same model: scenarios
of designs that are compared, runs that somebody told. The page is written last, and names the worst of them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.report.page.blocks import quantity
from workbench.report.page.folder import CampaignFolder
from workbench.space.box import Space

__all__ = ["ROUNDING", "later_sentence", "worse_run"]

ROUNDING = 1e-9  # of the value: what a sum in another order may change
MOST = 1000  # runs beyond it that are looked at for one inside the bounds


def worse_run(folder: CampaignFolder, worst: Mapping[str, Any]) -> tuple[float, str] | None:
    """Value and key of the worst run inside bounds, constraints and limits that goes beyond a worst case of
    `worst_case.json`; None where there is none. Of noisy runs a single one says nothing of a mean.
    """
    if worst.get("mean") is not None:
        return None
    runs = folder.runs
    there = runs.with_status("ok")
    weights = worst.get("weights") or {str(worst["response"]): 1.0}
    values = sum(weight * runs.values(name)[there] for name, weight in weights.items())
    for name, (low, high) in (worst.get("within") or {}).items():
        held = runs.values(name)[there]
        out = np.zeros(len(there), dtype=bool)
        out |= False if low is None else ~(held >= low)
        out |= False if high is None else ~(held <= high)
        values = np.where(out, np.nan, values)
    signed = (1.0 if worst["sense"] == "max" else -1.0) * (values - worst["value"])
    beyond = np.flatnonzero(np.nan_to_num(signed, nan=-np.inf) > ROUNDING * abs(worst["value"]))
    if not len(beyond):
        return None
    space = _space(folder)
    order = beyond[np.argsort(-signed[beyond], kind="stable")][:MOST]
    for place in order:
        (run,) = runs.at(there[[place]])
        if space is None or _is_inside(space, run.inputs):
            return float(values[place]), run.key
    return None


def later_sentence(folder: CampaignFolder, later: tuple[float, str], unit: str) -> str:
    """That a run of another stage, its value and key, is worse."""
    value, key = later
    return f"A run that came after the search went to {quantity(value, unit)}: {folder.run_name(key)}."


def _space(folder: CampaignFolder) -> Space | None:
    resolved = folder.lock.get("resolved") or {}
    given = resolved.get("parameter")
    if not given:
        return None
    return Space.from_dict({"parameters": given, "constraints": resolved.get("constraint") or []})


def _is_inside(space: Space, inputs: Mapping[str, Any]) -> bool:
    row = dict(inputs)
    try:
        space.unit([row])
    except (StudyError, KeyError):
        return False
    return space.violated(row) is None

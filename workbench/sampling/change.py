"""A design that changed under stored runs: which of them serve on, which not and why, how many are new.

The runs that lie in the present space stay in the design, under their ids, with their values to the last bit.
New ones spread best among them. Kinds whose points are fixed (grids, factorials, classical designs) are drawn
as they are: stored runs serve where the points agree.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.sampling.kinds import KINDS
from workbench.space.box import Space
from workbench.space.units import counted

__all__ = ["DesignChange", "change_sentence", "design_change", "growth_model", "serves_on"]

FIXED = ("grid", "factorial", "classical")  # ways of kinds whose points are what they are
BY_MODEL = ("chosen", "within")  # ways of kinds that are best for a regression model


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignChange:
    """What becomes of a design's runs.

    kept: run id -> parameters, of the runs that serve on    left_out: why others do not -> how many
    new: how many are to be made beside them
    """

    kept: Mapping[str, Mapping[str, Any]]
    left_out: Mapping[str, int]
    new: int

    @property
    def sentence(self) -> str:
        """For a person."""
        return change_sentence(len(self.kept), self.new, self.left_out)


def change_sentence(kept: int, new: int, left_out: Mapping[str, int]) -> str:
    """What becomes of a design, for a person: how many runs serve on, are new, do not serve, and why."""
    lost = "".join(f"; {count} do not: {reason}" for reason, count in left_out.items())
    serve = counted(kept, "run of the design that is there serves", "runs of the design that is there serve")
    return f"{serve} on, {new} {'is' if new == 1 else 'are'} new{lost}"


def serves_on(kind: str) -> bool:
    """Whether the runs of a design of this kind stay in it when it changes; else it is drawn as it is."""
    return kind in KINDS and KINDS[kind].way not in FIXED


def design_change(
    space: Space,
    table: Mapping[str, Any],
    document: Mapping[str, Any],
    answered: Sequence[bool],
    *,
    seed: int,
    at_baseline: bool,
) -> DesignChange | None:
    """What becomes of the design in `document` in the present space; None: it is drawn afresh.

    Args:
        table: `[design]`.    answered: for every run of the document whether it has an answer.
        seed: of the study.
        at_baseline: whether runs made before a parameter was added count as made at its baseline.

    Raises:
        StudyError: the seed changed under answered runs.
    """
    if not any(answered) or not serves_on(table["kind"]):
        return None
    if document["seed"] != seed:
        raise StudyError(
            f"[study] seed = {seed}, but {counted(sum(answered), 'stored run')} of a design with seed "
            f"{document['seed']} would be lost. Set seed = {document['seed']} again, or choose another "
            "--folder"
        )
    names = [parameter["name"] for parameter in document["parameters"]]
    # a design that only grows keeps the runs that wait, too
    is_same = document["space_hash"] == space.hash
    kept: dict[str, dict[str, Any]] = {}
    left_out: Counter[str] = Counter()
    for run, point, has_answer in zip(document["run_ids"], document["physical"], answered, strict=True):
        if not (has_answer or is_same):
            continue
        row, reason = _row_in(space, dict(zip(names, point, strict=True)), at_baseline=at_baseline)
        if row is None:
            left_out[reason] += 1
        else:
            kept[run] = row
    if not kept:
        _refuse_loss(left_out)
        return None
    runs = table.get("runs") or document["n"]
    new = max(runs - len(kept), 0 if is_same else _empty_strata(space, list(kept.values()), runs))
    return DesignChange(kept=kept, left_out=dict(left_out), new=new)


def growth_model(table: Mapping[str, Any]) -> str | None:
    """The regression model that new runs are best for; None where they fill the space."""
    return table.get("model", "linear") if KINDS[table["kind"]].way in BY_MODEL else None


def _row_in(space: Space, row: Mapping[str, Any], *, at_baseline: bool) -> tuple[dict[str, Any] | None, str]:
    """The run in the present space, or None and why it is none of it."""
    gone = [name for name in row if name not in space.names]
    if gone:
        return None, f"they vary {gone[0]!r}, which is no parameter any more"
    whole = dict(row)
    for parameter in space.parameters:
        if parameter.name in whole:
            continue
        if parameter.baseline is None:
            return None, f"the new parameter {parameter.name!r} has no baseline to take them at"
        if not at_baseline:
            return None, f"{parameter.name!r} is new; --at-baseline takes them as made at its baseline"
        whole[parameter.name] = parameter.baseline
    try:
        found = space.canonical(whole)
    except StudyError:
        return None, "they lie outside the bounds"
    if space.violated(found) is not None:
        return None, f"they break the constraint {space.violated(found)}"
    return found, ""


def _refuse_loss(left_out: Mapping[str, int]) -> None:
    """Runs that a flag would save are not thrown away without a word."""
    for reason, count in left_out.items():
        if "--at-baseline" in reason or "no baseline" in reason:
            runs = counted(count, "stored run does", "stored runs do")
            cure = "Say so" if "--at-baseline" in reason else "Give it a baseline and --at-baseline"
            raise StudyError(
                f"{runs} not serve: {reason}. {cure}, or choose another --folder for a campaign of its own"
            )


def _empty_strata(space: Space, rows: Sequence[Mapping[str, Any]], runs: int) -> int:
    """How many of `runs` strata of a parameter hold no run, of the parameter with most; levels share them."""
    unit = space.unit(rows)
    most = 0
    for column, levels in zip(unit.T, space.unit_levels, strict=True):
        if levels is None:
            here = np.unique(np.minimum((column * runs).astype(int), runs - 1))
            # inside their range the runs lie as their design wanted them: empty is what lies beyond it
            most = max(most, runs - int(here.max() - here.min() + 1))
        else:
            met = len(np.unique(np.abs(column[:, None] - levels).argmin(axis=1)))
            most = max(most, (len(levels) - met) * (runs // len(levels)))
    return most

"""Steps, diagnosis and verdict of a screening in plain types, with names for columns and runs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from surrogates import KrigingScreener
from surrogates.screening.path import ScreeningStep
from surrogates.screening.verdict import Judgement, ScreeningDiagnosis
from workbench.space.box import Space

__all__ = ["diagnosis_in_names", "judged_in_names", "shares_in_names", "step_in_names"]


def step_in_names(step: ScreeningStep, names: Sequence[str]) -> dict[str, Any]:
    """A step of the path, as `Screening.path` holds it; names (d,) of the columns."""
    return {
        "step": step.step,
        "selected": [names[k] for k in step.selected],
        "added": [names[k] for k in step.added],
        "theta_common": step.theta_common,
        "theta": {names[k]: float(step.theta[k]) for k in step.selected},
        "sigma2": step.sigma2,
        "nugget": step.nugget,
        "log_likelihood": step.log_likelihood,
        "gain": step.gain,
        "accepted": step.accepted,
    }


def shares_in_names(screener: KrigingScreener, names: Sequence[str]) -> dict[str, Any]:
    """What a screening of a part of the runs says, with names (d,) for columns."""
    judged = screener.judgement(names)
    share = screener.diagnosis_.hidden_share
    return {
        "selected": [names[k] for k in screener.selected_],
        "minor": [names[k] for k in screener.minor_],
        "state": judged.state,
        "hidden_share": share,
        "verdict": judged.verdict,
    }


def diagnosis_in_names(
    facts: ScreeningDiagnosis, judged: Judgement, names: Sequence[str], ids: Sequence[str]
) -> dict[str, Any]:
    """The diagnosis with names (d,) for columns, ids (n,) for runs, and the verdict in these names."""
    plain = (
        "n_runs n_inputs threshold base_log_likelihood nugget starts starts_at_best search_runs evaluations"
    )
    found = {
        name: getattr(facts, name)
        for name in [*plain.split(), "margin", "q2", "resolved", "unexplained", "hidden_share", "open_share"]
    }
    if facts.shares_of == "ranks":
        found |= {"own_unexplained": facts.own_unexplained}
    return found | {
        "shares_of": facts.shares_of,
        "nugget_bounds": list(facts.nugget_bounds),
        "state": judged.state,
        "verdict": judged.verdict,
        "advice": judged.advice,
        "confirmed": [names[k] for k in facts.confirmed],
        "disputed": [names[k] for k in facts.disputed],
        "open": [names[k] for k in facts.open],
        "minor": [names[k] for k in facts.minor],
        "border": [names[k] for k in facts.border],
        "shares": {names[one.column]: [one.mean, one.lower, one.upper] for one in facts.shares},
        "constant": [names[k] for k in facts.constant],
        "repeated": [[names[i], names[j]] for i, j in facts.repeated],
        "duplicates": [[ids[i], ids[j]] for i, j in facts.duplicates],
        "near_duplicates": [[ids[i], ids[j]] for i, j in facts.near_duplicates],
        "rivals": [{"selected": [names[k] for k in s], "lower_by": gap} for s, gap in facts.rivals],
    }


def judged_in_names(screener: KrigingScreener, space: Space) -> Judgement:
    """The verdict of a screening with names for columns and values in their own units."""
    return screener.judgement(space.names, lambda k, u: _placed(space, k, u))


def _placed(space: Space, column: int, unit_value: float) -> str:
    """A value of a column of the unit cube, as the parameter has it."""
    parameter = space.parameters[column]
    value = parameter.physical(np.array([min(max(unit_value, 0.0), 1.0)]))[0]
    return f"{float(value):.4g}" + ("" if parameter.unit in ("", "1") else f" {parameter.unit}")

"""What a screening found, with names."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd

__all__ = ["Screening"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Screening:
    """The outcome of a screening, with names.

    Attributes:
        response, unit: what was screened.   method, criterion, rule: how, in words.   scale: of what the
            parameters were selected, where not of the response itself, and why; "" where they were.
        n_runs, n_left_out: runs used, and runs without a value.
        path: one mapping per step: step, selected, added, theta_common, theta, sigma2, nugget,
            log_likelihood, gain, accepted. theta is per unit of the [0, 1] scale of each parameter, squared.
        selected: names, as they entered.   minor: those that act and stay below 1 % of the variance, which
            stand apart from the selected ones.   ranking: all names, the one that most likely acts first;
            with too few runs a selected one may stand behind one that is not.
        theta: of the selected set, by name.
        state: "resolved", "partly resolved", "not resolved", "not judged" or "nothing to screen".
        hidden_share: x, the share of the variance above which no parameter is missing.
        verdict, advice: the state with its reasons, and what to do.
        stability: share of delete-a-tenth resamples that select the parameter, by name; empty for "welch".
        kriging, leave_one_out, main_effects, sobol: of the Kriging with the selected and the minor
            parameters (see `surrogates.selected_kriging`); empty if none. kriging["interval_factor"] says by
            what cross-validation scaled its intervals, sobol["averaged_over"] which law of each parameter
            effects and indices rest on (see `workbench.space.laws`).
        diagnosis: facts about the search and the runs.
        regimes: where the response switches between two, see `workbench.screening.regimes`; None where it
            does not, or was not asked.
    """

    response: str
    unit: str
    method: str
    criterion: str
    rule: str
    n_runs: int
    n_left_out: int
    path: tuple[dict[str, Any], ...]
    selected: tuple[str, ...]
    minor: tuple[str, ...]
    ranking: tuple[str, ...]
    theta: dict[str, float]
    state: str
    hidden_share: float
    verdict: str
    advice: str
    stability: dict[str, float]
    kriging: dict[str, Any]
    leave_one_out: dict[str, Any]
    main_effects: dict[str, Any]
    sobol: dict[str, Any]
    diagnosis: dict[str, Any]
    regimes: dict[str, Any] | None = None
    scale: str = ""

    def to_dict(self) -> dict[str, Any]:
        """The document `screening.json`: plain lists, numbers and strings; NaN and infinity become None."""
        return dict(_plain(asdict(self)))

    def to_frame(self) -> pd.DataFrame:
        """The path as a table, one row per step."""
        columns = ["step", "selected", "theta_common", "sigma2", "log_likelihood", "gain", "accepted"]
        frame = pd.DataFrame([{c: step[c] for c in columns} for step in self.path], columns=columns)
        frame["selected"] = [", ".join(names) for names in frame["selected"]]
        return frame.set_index("step")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(v) for v in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not isfinite(value):
        return None
    return value

"""Which parameters matter: rows of a study in, a screening with names and units out.

The screening itself stands in `surrogates`; here runs without a value are left out and counted, parameters
become columns of the unit cube and categorical ones labels, and everything that comes back carries names.
After the selection one Kriging is fitted to the selected parameters; leave-one-out, main effects and
Sobol' indices are those of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.stats import rankdata

from surrogates import (
    Kriging,
    KrigingScreener,
    Measure,
    main_effects,
    selected_kriging,
    selection_stability,
    sobol_indices,
)
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Outcome
from workbench.space.box import Space
from workbench.space.groups import check_selection
from workbench.space.laws import input_law, input_measure
from workbench.space.parameter import Response
from workbench.space.streams import stream

__all__ = ["METHODS", "Screening", "screen"]

METHODS = ("default", "forward", "welch")
TRANSFORMS = ("none", "ranks")
FEWEST_RUNS = 3
CURVE_POINTS = 25
SOBOL_DRAWS = 60
STABILITY_RUNS = 130  # resamples for larger designs cost seconds each
RESAMPLES, RESAMPLES_OF_LARGE = 20, 4

Rows = Sequence[Outcome | Mapping[str, Any]] | pd.DataFrame | xr.Dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class Screening:
    """The outcome of a screening, with names.

    Attributes:
        response, unit: what was screened.   method, criterion, rule: how, in words.
        n_runs, n_left_out: runs used, and runs without a value.
        path: one mapping per step: step, selected, added, theta_common, theta, sigma2, nugget,
            log_likelihood, gain, accepted. theta is per unit of the [0, 1] scale of each parameter, squared.
        selected: names, as they entered.   ranking: all names, the one that most likely acts first;
            with too few runs a selected one may stand behind one that is not.
        theta: of the selected set, by name.
        verdict, advice: whether it is resolved, and what to do if not.
        stability: share of delete-a-tenth resamples that select the parameter, by name; empty for "welch".
        kriging, leave_one_out, main_effects, sobol: of the Kriging with the selected parameters (see
            `surrogates.selected_kriging`); empty if none. kriging["interval_factor"] says by what
            cross-validation scaled its intervals, sobol["averaged_over"] which law of each parameter effects
            and indices rest on (see `workbench.space.laws`).
        diagnosis: facts about the search and the runs.
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
    ranking: tuple[str, ...]
    theta: dict[str, float]
    verdict: str
    advice: str
    stability: dict[str, float]
    kriging: dict[str, Any]
    leave_one_out: dict[str, Any]
    main_effects: dict[str, Any]
    sobol: dict[str, Any]
    diagnosis: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """The document `screening.json`: plain lists, numbers and strings; NaN and infinity become None."""
        return dict(_plain(asdict(self)))

    def to_frame(self) -> pd.DataFrame:
        """The path as a table, one row per step."""
        columns = ["step", "selected", "theta_common", "sigma2", "log_likelihood", "gain", "accepted"]
        frame = pd.DataFrame([{c: step[c] for c in columns} for step in self.path], columns=columns)
        frame["selected"] = [", ".join(names) for names in frame["selected"]]
        return frame.set_index("step")


def screen(
    rows: Rows,
    space: Space,
    response: Response | str,
    *,
    method: str = "default",
    transform: str = "none",
    seed: int = 0,
    n_selected: int | None = None,
    groups: Sequence[Sequence[str]] = (),
    effects: bool = True,
) -> Screening:
    """Screen the parameters of `space` for a response.

    >>> import numpy as np
    >>> from workbench.space.parameter import Parameter
    >>> space = Space([Parameter("k", lower=0, upper=2, unit="N/m"), Parameter("c", lower=1, upper=5)])
    >>> points = np.random.default_rng(0).random((20, 2))
    >>> rows = [{**row, "f": np.sin(3 * row["k"])} for row in space.rows(points)]
    >>> screen(rows, space, "f").selected
    ('k',)

    Args:
        rows: runs as outcomes of a campaign, mappings of parameters and response, a DataFrame or a Dataset.
            Runs that failed or have no finite response are left out and counted.
        method: "default", "forward" (as published) or "welch".
        transform: "none", or "ranks": parameters are selected by the ranks of the response (Iman and Conover,
            Technometrics 21, 1979), which suits one that jumps between two levels. The Kriging of the
            selected parameters and its effects are of the response itself.
        seed: of the starts, the resamples and the draws.
        n_selected: how many parameters to select, instead of deciding it.
        groups: names of parameters that are to be selected together.
        effects: whether to fit the Kriging of the selected parameters and its effects.

    Raises:
        NotEnoughRuns: fewer than 3 usable runs.
        StudyError: an unknown method, transform or name, groups or a number that do not fit, a run that
            holds no number where there should be one, or a response that no run has.
    """
    response = Response(response) if isinstance(response, str) else response
    if method not in METHODS:
        raise StudyError(f"screening method needs one of {', '.join(METHODS)}, got {method!r}")
    if transform not in TRANSFORMS:
        raise StudyError(f"screening transform needs one of {', '.join(TRANSFORMS)}, got {transform!r}")
    check_selection(space.names, groups=groups, n_selected=n_selected)
    ids, inputs, values, left_out = _usable(_as_outcomes(rows, space, response.name), space, response.name)
    x, labels = _columns(space, ids, inputs), space.label_columns
    y = np.array(values)
    screener = KrigingScreener(
        method=method,
        n_features=n_selected,
        categorical=labels,
        groups=[[space.names.index(name) for name in group] for group in groups],
        seed=seed,
    ).fit(x, rankdata(y) if transform == "ranks" else y)
    names = np.array(space.names)
    stability: dict[str, float] = {}
    if method != "welch":
        resamples = RESAMPLES if len(y) <= STABILITY_RUNS else RESAMPLES_OF_LARGE
        share = selection_stability(screener, resamples=resamples, rng=stream(seed, "stability"))
        stability = dict(zip(space.names, share.tolist(), strict=True))
    facts = screener.diagnosis_
    model = _Model.fit(screener, x, y, ids, seed) if effects and len(screener.selected_) else None
    return Screening(
        response=response.name,
        unit=response.unit,
        method=method,
        criterion=facts.criterion + (", of the ranks of the response" if transform == "ranks" else ""),
        rule=facts.rule,
        n_runs=len(y),
        n_left_out=left_out,
        path=tuple(_step(step, space.names) for step in screener.path_),
        selected=tuple(names[screener.selected_].tolist()),
        ranking=tuple(names[screener.ranking_].tolist()),
        theta=dict(zip(space.names, screener.theta_.tolist(), strict=True)),
        verdict=facts.verdict,
        advice=_named(facts.advice, facts.repeated, space.names),
        stability=stability,
        kriging=model.kriging(space.names) if model else {},
        leave_one_out=model.leave_one_out() if model else {},
        main_effects=model.main_effects(space) if model else {},
        sobol=model.sobol(space) if model else {},
        diagnosis=_diagnosis(facts, space.names, ids),
    )


@dataclass(frozen=True, slots=True)
class _Model:
    """The Kriging of the selected parameters."""

    columns: list[int]
    fitted: Kriging
    x: np.ndarray
    seed: int

    @classmethod
    def fit(
        cls, screener: KrigingScreener, x: np.ndarray, y: np.ndarray, ids: list[str], seed: int
    ) -> "_Model":
        columns = screener.get_support(indices=True).tolist()
        return cls(columns, selected_kriging(screener, x, y, run_ids=ids), x, seed)

    def _by_name(self, values: np.ndarray, names: Sequence[str]) -> dict[str, float]:
        return {names[k]: float(v) for k, v in zip(self.columns, values, strict=True)}

    def kriging(self, names: Sequence[str]) -> dict[str, Any]:
        k = self.fitted
        return {
            "trend": "constant",
            "correlation": "gaussian",
            "theta": self._by_name(k.theta_, names),
            "sigma2": float(k.sigma2_),
            "nugget": float(k.nugget_),
            "beta": [float(b) for b in np.ravel(k.beta_)],
            "log_likelihood": float(k.log_likelihood_),
            "calibration": k.calibration,
            "interval_factor": float(k.interval_factor_),
        }

    def leave_one_out(self) -> dict[str, Any]:
        left = self.fitted.leave_one_out()
        return {
            "run_ids": list(left.run_ids),
            "observed": left.observed,
            "predicted": left.prediction,
            "std": left.std,
            "standardised": left.standardised,
            "q2": left.q2,
            "coverage95": left.coverage95,
        }

    def main_effects(self, space: Space) -> dict[str, Any]:
        found = {}
        effects = main_effects(self.fitted, points=CURVE_POINTS, measures=self._measures(space))
        for k, effect in zip(self.columns, effects, strict=True):
            parameter = space.parameters[k]
            x = np.asarray(effect.x, dtype=float)
            if parameter.kind == "categorical":  # the Kriging numbers the labels of the runs 0, 1, ...
                x = np.unique(self.x[:, k])[np.asarray(x, dtype=int)]
            found[parameter.name] = {
                "x": parameter.physical(np.clip(x, 0.0, 1.0)).tolist(),
                "mean": effect.mean,
                "lower": effect.lower,
                "upper": effect.upper,
            }
        return found

    def _measures(self, space: Space) -> list[Measure | None]:
        return [input_measure(space.parameters[k]) for k in self.columns]

    def sobol(self, space: Space) -> dict[str, Any]:
        names, k = space.names, len(self.columns)
        pairs = [(i, j) for i in range(k) for j in range(i + 1, k)] if k <= 12 else []
        indices = sobol_indices(
            self.fitted,
            draws=SOBOL_DRAWS,
            pairs=pairs,
            measures=self._measures(space),
            rng=stream(self.seed, "sobol"),
        )
        found: dict[str, Any] = {
            "averaged_over": {names[k]: input_law(space.parameters[k]) for k in self.columns}
        }
        for kind, part in (("main", indices.main), ("total", indices.total)):
            found[kind] = self._by_name(part.mean, names)
            found[f"{kind}_lower"] = self._by_name(part.lower, names)
            found[f"{kind}_upper"] = self._by_name(part.upper, names)
        found["interactions"] = [
            {
                "pair": [names[self.columns[i]], names[self.columns[j]]],
                "mean": float(indices.interaction.mean[at]),
                "lower": float(indices.interaction.lower[at]),
                "upper": float(indices.interaction.upper[at]),
            }
            for at, (i, j) in enumerate(indices.pairs)
        ]
        return found


def _as_outcomes(rows: Rows, space: Space, response: str) -> list[Outcome]:
    if isinstance(rows, xr.Dataset):
        rows = rows.to_dataframe().reset_index()
    if isinstance(rows, pd.DataFrame):
        missing = [c for c in (*space.names, response) if c not in rows.columns]
        if missing:
            raise StudyError(f"the table of runs has no column {missing[0]!r}; it has {list(rows.columns)}")
        table = rows[[*space.names, response]].to_dict("records")
        index = [str(i) for i in rows.index]
        return [_outcome(row, space, response, key) for row, key in zip(table, index, strict=True)]
    found = []
    for i, row in enumerate(rows):
        if isinstance(row, Outcome):
            found.append(row)
            continue
        missing = [name for name in (*space.names, response) if name not in row]
        if missing:
            raise StudyError(f"run {i} has no {missing[0]!r}; it has {list(row)}")
        found.append(_outcome(row, space, response, str(i)))
    return found


def _outcome(row: Mapping[Any, Any], space: Space, response: str, key: str) -> Outcome:
    value = row[response]
    try:
        number = float("nan") if value is None or value is pd.NA else float(value)
    except (TypeError, ValueError):
        raise StudyError(
            f"run {key} has {value!r} where a number of {response!r} should be: leave the run out, or give "
            "it None or NaN to have it counted as failed"
        ) from None
    status = "ok" if isfinite(number) else "nonfinite"
    outputs = {response: number} if status == "ok" else {}
    return Outcome(parameters={n: row[n] for n in space.names}, status=status, outputs=outputs, key=key)


def _usable(
    outcomes: Sequence[Outcome], space: Space, response: str
) -> tuple[list[str], list[Mapping[str, Any]], list[float], int]:
    ids: list[str] = []
    inputs: list[Mapping[str, Any]] = []
    values: list[float] = []
    for i, run in enumerate(outcomes):
        if run.status == "ok" and response not in run.outputs:
            raise StudyError(f"run {run.key or i} has no response {response!r}; it has {list(run.outputs)}")
        if run.status == "ok" and isfinite(float(run.outputs[response])):
            ids.append(run.key or str(i))
            inputs.append({name: run.parameters[name] for name in space.names})
            values.append(float(run.outputs[response]))
    if len(values) < FEWEST_RUNS:
        raise NotEnoughRuns(
            f"screening {response!r} needs at least {FEWEST_RUNS} runs with a value, got {len(values)} of "
            f"{len(outcomes)}: add runs or look at why they failed"
        )
    return ids, inputs, values, len(outcomes) - len(values)


def _columns(space: Space, ids: Sequence[str], inputs: Sequence[Mapping[str, Any]]) -> np.ndarray:
    try:
        return np.asarray(space.unit(inputs), dtype=float)
    except StudyError as error:
        for key, row in zip(ids, inputs, strict=True):
            try:
                space.unit([row])
            except StudyError as single:
                raise StudyError(f"run {key}: {single}. Correct it, or leave the run out") from error
        raise


def _step(step: Any, names: Sequence[str]) -> dict[str, Any]:
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


def _named(advice: str, pairs: Sequence[tuple[int, int]], names: Sequence[str]) -> str:
    for i, j in pairs:
        advice = advice.replace(f"{i} and {j}", f"{names[i]} and {names[j]}")
    return advice


def _diagnosis(facts: Any, names: Sequence[str], ids: Sequence[str]) -> dict[str, Any]:
    plain = (
        "n_runs n_inputs threshold base_log_likelihood nugget starts starts_at_best search_runs evaluations"
    )
    found = {name: getattr(facts, name) for name in [*plain.split(), "margin", "q2", "resolved", "verdict"]}
    return found | {
        "nugget_bounds": list(facts.nugget_bounds),
        "advice": _named(facts.advice, facts.repeated, names),
        "constant": [names[k] for k in facts.constant],
        "repeated": [[names[i], names[j]] for i, j in facts.repeated],
        "duplicates": [[ids[i], ids[j]] for i, j in facts.duplicates],
        "near_duplicates": [[ids[i], ids[j]] for i, j in facts.near_duplicates],
        "rivals": [{"selected": [names[k] for k in s], "lower_by": gap} for s, gap in facts.rivals],
    }


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

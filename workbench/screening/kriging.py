"""Which parameters matter: rows of a study in, a screening with names and units out.

The screening itself stands in `surrogates`; here parameters become columns of the unit cube and categorical
ones labels, and everything that comes back carries names.
"""

from collections.abc import Sequence

import numpy as np

from surrogates import (
    RESPONSE_SCALES,
    KrigingScreener,
    judged_on_response,
    on_scale,
    selection_stability,
)
from workbench.errors import StudyError
from workbench.screening.in_names import diagnosis_in_names, judged_in_names, step_in_names
from workbench.screening.record import Screening
from workbench.screening.regimes import screened_regimes
from workbench.screening.scale import SCALES_IN_WORDS, chosen_scale
from workbench.screening.selected import SelectedKriging
from workbench.screening.usable_runs import Rows, usable_runs
from workbench.space.box import Space, need_space
from workbench.space.groups import check_selection
from workbench.space.laws import input_measure
from workbench.space.parameter import Response
from workbench.space.streams import stream

__all__ = ["METHODS", "checked_method", "screen"]

METHODS = ("default", "forward", "welch")
TRANSFORMS = ("none", "auto", *RESPONSE_SCALES[1:])
STABILITY_RUNS = 130  # resamples for larger designs cost seconds each
DECADES = 1.5  # of a positive response: where screened as it is, its other scales are worth a try
RESAMPLES, RESAMPLES_OF_LARGE = 20, 4


def checked_method(method: str) -> str:
    """The method, where there is one of that name; else a StudyError."""
    if method not in METHODS:
        raise StudyError(f"screening method needs one of {', '.join(METHODS)}, got {method!r}")
    return method


def screen(
    rows: Rows,
    space: Space,
    response: Response | str,
    *,
    method: str = "default",
    transform: str | None = None,
    regimes: str = "auto",
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
        transform: what parameters are selected by: "none", "log" for one over decades, "ranks" (Iman and
            Conover, Technometrics 21, 1979) for one that jumps between two levels, "box-cox" for a power of a
            positive response and "yeo-johnson" of any, or "auto" for the one of these that predicts left-out
            runs best on the response's own scale (`surrogates.choose_scale`). Left out: "auto" for the
            method "default", "none" for the published ones.
            The Kriging of the selected parameters is of that scale (but ranks) and carried back: predictions,
            intervals, main effects and Sobol' indices are of the response. The share that may hide is one
            of the response's own variance, and of that of the scale: the larger; of ranks it is one of
            their variance.
        regimes: "auto" looks for two regimes with nothing between, and screens the switch and the runs of
            each, beside all runs; "off" does not.
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
    checked_method(method)
    if transform is None:
        transform = "auto" if method == "default" else "none"
    if transform not in TRANSFORMS:
        raise StudyError(f"screening transform needs one of {', '.join(TRANSFORMS)}, got {transform!r}")
    if regimes not in ("auto", "off"):
        raise StudyError(f"screening regimes needs 'auto' or 'off', got {regimes!r}")
    need_space(space, name="space")
    check_selection(space.names, groups=groups, n_selected=n_selected)
    runs = usable_runs(rows, space, response.name)
    ids, x, y = runs.ids, runs.x, runs.y
    screener = KrigingScreener(
        method=method,
        n_features=n_selected,
        categorical=space.label_columns,
        groups=[[space.names.index(name) for name in group] for group in groups],
        measures=[input_measure(parameter) for parameter in space.parameters],
        seed=seed,
    )
    scale, reason = chosen_scale(screener, x, y, transform, response.name)
    screener.fit(x, on_scale(y, scale))
    judged_on_response(screener, x, y, scale)
    names, words = np.array(space.names), SCALES_IN_WORDS[scale]
    stability: dict[str, float] = {}
    if method != "welch":
        resamples = RESAMPLES if len(y) <= STABILITY_RUNS else RESAMPLES_OF_LARGE
        share = selection_stability(screener, resamples=resamples, rng=stream(seed, "stability"))
        stability = dict(zip(space.names, share.tolist(), strict=True))
    facts = screener.diagnosis_
    judged = judged_in_names(screener, space)
    wanted = effects and len(screener.selected_)
    model = SelectedKriging.fit(screener, x, y, ids, seed, scale) if wanted else None
    return Screening(
        response=response.name,
        unit=response.unit,
        method=method,
        criterion=facts.criterion + (f", of {words}" if words else "") + reason,
        scale=words + reason if words else "",
        rule=facts.rule,
        n_runs=len(y),
        n_left_out=runs.n_left_out,
        path=tuple(step_in_names(step, space.names) for step in screener.path_),
        selected=tuple(names[screener.selected_].tolist()),
        minor=tuple(names[screener.minor_].tolist()),
        ranking=tuple(names[screener.ranking_].tolist()),
        theta=dict(zip(space.names, screener.theta_.tolist(), strict=True)),
        state=judged.state,
        hidden_share=facts.hidden_share,
        verdict=judged.verdict,
        advice="; ".join(filter(None, (judged.advice, _advised_scale(y, transform, response.name)))),
        stability=stability,
        kriging=model.kriging(space.names) if model else {},
        leave_one_out=model.leave_one_out() if model else {},
        main_effects=model.main_effects(space) if model else {},
        sobol=model.sobol(space) if model else {},
        diagnosis=diagnosis_in_names(facts, judged, space.names, ids),
        regimes=None
        if regimes == "off"
        else screened_regimes(
            screener, x, y, space, names=response.regimes, unit=response.unit, rng=stream(seed, "regimes")
        ),
    )


def _advised_scale(y: np.ndarray, transform: str, response: str) -> str:
    """What to try where a response over decades was screened as it is."""
    if transform != "none" or not y.min() > 0 or y.max() < 10**DECADES * y.min():
        return ""
    decades = np.log10(y.max() / y.min())
    return f'{response} spans {decades:.2g} decades: transform = "auto" in [screen] tries other scales'

"""Other views of which parameters matter, beside the screening of the study: `holdfast screen --method ...`.

Nothing here replaces `screening.json`, which the later stages read: these are looks at the same runs by
other methods, or, for Morris, at runs made for it.
"""

from typing import Any

import numpy as np

from surrogates import (
    KrigingScreener,
    compare_rankings,
    hybrid_screening,
    morris_effects,
    morris_points,
)
from workbench.campaign.runs import CampaignRuns
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Outcome
from workbench.screening.kriging import METHODS, screen
from workbench.space.groups import chosen
from workbench.space.parameter import Response
from workbench.space.streams import stream
from workbench.stages.stored_runs import screening_runs

__all__ = ["OTHER_METHODS", "other_screening"]

OTHER_METHODS = (*METHODS, "rivals", "morris", "hybrid")
TRAJECTORIES = 4


def other_screening(
    campaign: CampaignRuns, method: str, *, trajectories: int = TRAJECTORIES
) -> dict[str, Any]:
    """Screen a campaign's runs by a method of choice; a document with names.

    Args:
        method: "default", "forward" or "welch" on the stored runs; "rivals" for several rankings of them side
            by side; "morris" for elementary effects, which makes runs of its own unless they are stored;
            "hybrid" for the likelihood on those runs together with the stored ones.
        trajectories: of Morris, each one run more than there are parameters.

    Raises:
        StudyError: an unknown method, no [screen] table, or Morris with a model that cannot be run.
        NotEnoughRuns: fewer usable runs than the method needs.
    """
    if method not in OTHER_METHODS:
        raise StudyError(f"screening method needs one of {', '.join(OTHER_METHODS)}, got {method!r}")
    table = campaign.study.screen
    if table is None:
        raise StudyError("the study has no [screen] table, which names the response to screen")
    response = campaign.study.response(table["response"])
    if method in METHODS:
        stored = [row.as_outcome() for row in screening_runs(campaign)]
        return screen(
            stored,
            campaign.study.space,
            response,
            method=method,
            transform=table["transform"],
            seed=campaign.study.seed,
            **chosen(table),
        ).to_dict()
    if method == "rivals":
        return _rivals(campaign, response)
    return _morris(campaign, response, trajectories, hybrid=method == "hybrid")


def _usable(
    campaign: CampaignRuns, outcomes: list[Outcome], response: str
) -> tuple[np.ndarray, np.ndarray, int]:
    """Unit points (n, d) and responses (n,) of the runs with a finite value; how many have none."""
    good = [run for run in outcomes if np.isfinite(_value(run, response))]
    points = campaign.study.space.unit([run.parameters for run in good])
    return points, np.array([_value(run, response) for run in good]), len(outcomes) - len(good)


def _value(run: Outcome, response: str) -> float:
    return float(run.outputs.get(response, np.nan)) if run.status == "ok" else float("nan")


def _rivals(campaign: CampaignRuns, response: Response) -> dict[str, Any]:
    outcomes = [row.as_outcome() for row in screening_runs(campaign)]
    x, y, left_out = _usable(campaign, outcomes, response.name)
    if len(y) < 5:
        raise NotEnoughRuns(f"rivals need at least 5 runs with a value of {response.name!r}, got {len(y)}")
    names = campaign.study.space.names
    try:
        found = compare_rankings(
            x, y, categorical=campaign.study.space.label_columns, rng=stream(campaign.study.seed, "rivals")
        )
    except ValueError as error:  # the same response in every run
        raise StudyError(f"rivals cannot rank {response.name!r}: {error}") from error
    return {
        "method": "rivals",
        "response": response.name,
        "unit": response.unit,
        "n_runs": len(y),
        "n_left_out": left_out,
        "rankings": [
            {
                "method": one.method,
                "ranking": [names[k] for k in one.ranking],
                "selected": None if one.selected is None else [names[k] for k in one.selected],
                "cpu_seconds": one.cpu_seconds,
            }
            for one in found
        ],
    }


def _morris(campaign: CampaignRuns, response: Response, trajectories: int, *, hybrid: bool) -> dict[str, Any]:
    study = campaign.study
    if study.model["kind"] == "table":
        raise StudyError("Morris needs runs of its own, and a table cannot be run: take --method rivals")
    d, names = study.space.dimension, study.space.names
    points = morris_points(d, trajectories, rng=stream(study.seed, "morris"))
    made = [row.as_outcome() for row in campaign.evaluate(study.space.rows(points), batch="morris")]
    values = np.array([_value(run, response.name) for run in made]).reshape(trajectories, d + 1)
    whole = np.isfinite(values).all(axis=1)  # a trajectory with a failed run gives no effects
    if not whole.any():
        raise NotEnoughRuns(f"every trajectory has a run without {response.name!r}; see `holdfast failures`")
    rows = np.repeat(whole, d + 1)
    effects = morris_effects(points[rows], values[whole].ravel())
    document = {
        "method": "hybrid" if hybrid else "morris",
        "response": response.name,
        "unit": response.unit,
        "n_runs": int(rows.sum()),
        "n_left_out": int((~rows).sum()),
        "ranking": [names[k] for k in effects.ranking],
        "mu": dict(zip(names, effects.mu.tolist(), strict=True)),
        "mu_star": dict(zip(names, effects.mu_star.tolist(), strict=True)),
        "sigma": {
            n: None if np.isnan(s) else float(s) for n, s in zip(names, effects.sigma.tolist(), strict=True)
        },
    }
    if not hybrid:
        return document
    x, y, _ = _usable(campaign, [row.as_outcome() for row in screening_runs(campaign)], response.name)
    both = hybrid_screening(
        points[rows],
        values[whole].ravel(),
        screener=KrigingScreener(categorical=study.space.label_columns),
        run_at=study.space.unit([run.parameters for run, kept in zip(made, rows, strict=True) if kept]),
        more_points=x if len(y) else None,
        more_y=y if len(y) else None,
    )
    facts = both.screener.diagnosis_
    return document | {
        "stored_runs": len(y),
        "selected": [names[k] for k in both.screener.selected_],
        "agreed": [names[k] for k in both.agreed],
        "disputed": [names[k] for k in both.disputed],
        "verdict": facts.verdict,
        "advice": facts.advice,
    }

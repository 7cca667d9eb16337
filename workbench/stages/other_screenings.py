"""Other views of which parameters matter, beside the screening of the study: `holdfast screen --method ...`.

Nothing here replaces `screening.json`, which the later stages read: these are looks at the same runs by
other methods, or, for Morris, at runs made for it. Indices and elementary effects are kept in
`sensitivity.json`, from where the report shows them.
"""

from typing import Any

import numpy as np

from surrogates import (
    KrigingScreener,
    compare_rankings,
    hybrid_screening,
    morris_effects,
    morris_points,
    on_scale,
)
from workbench.campaign.results.functionals import with_functionals
from workbench.campaign.runs import CampaignRuns
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Outcome, response_reader
from workbench.screening.in_names import judged_in_names
from workbench.screening.indices import indices_document
from workbench.screening.kriging import METHODS, screen
from workbench.screening.named_methods import INDICES, NAMED_METHODS, named
from workbench.screening.scale import SCALES_IN_WORDS, chosen_scale
from workbench.space.groups import chosen
from workbench.space.laws import input_measure
from workbench.space.parameter import Response
from workbench.space.streams import stream
from workbench.stages.screen import MOST_RUNS
from workbench.stages.stored_runs import screening_chunks, screening_columns, thinned
from workbench.system.atomic import read_json, write_json

__all__ = ["OTHER_METHODS", "other_screening"]

OTHER_METHODS = tuple(method.name for method in NAMED_METHODS)
TRAJECTORIES = 4
MOST_PAIRS = 1_000  # runs of which every two are compared


def other_screening(
    campaign: CampaignRuns,
    method: str | None = None,
    *,
    response: str | None = None,
    trajectories: int = TRAJECTORIES,
) -> dict[str, Any]:
    """Screen a campaign's runs by a method of choice; a document with names.

    Args:
        method: a name of `workbench.screening.named_methods`; None is that of the [screen] table. "morris"
            and "hybrid" make runs of their own unless they are stored.
        response: which; None is that of the [screen] table.
        trajectories: of Morris, each one run more than there are parameters.

    Raises:
        StudyError: an unknown method or response, neither a [screen] table nor a response, or Morris with a
            model that cannot be run.
        NotEnoughRuns: fewer usable runs than the method needs.
    """
    table = campaign.study.screen
    if table is None and response is None:
        raise StudyError(
            "the study has no [screen] table, which names the response to screen: add one, or name a response"
        )
    table = table or {}
    method = method or str(table.get("method", "default"))
    if method not in OTHER_METHODS:
        raise StudyError(f"screening method needs one of {', '.join(OTHER_METHODS)}, got {method!r}")
    wanted = campaign.study.target(table["response"] if response is None else response)
    if method in METHODS:
        return screen(
            _thinned(campaign, wanted.name),
            campaign.study.space,
            wanted,
            method=method,
            transform=table.get("transform"),
            seed=campaign.study.seed,
            **chosen(table),
        ).to_dict()
    if method == "rivals":
        return _rivals(campaign, wanted, str(table.get("transform", "auto")))
    if method in INDICES:
        x, y, left_out = _points(campaign, method, wanted.name)
        space = campaign.study.space
        found = indices_document(
            method, x, y, space, wanted, transform=table.get("transform"), seed=campaign.study.seed
        )
        return _kept(campaign, found | {"n_left_out": left_out})
    transform = str(table.get("transform", "auto"))
    found = _morris(campaign, wanted, trajectories, transform if method == "hybrid" else None)
    return found if method == "hybrid" else _kept(campaign, found)


def _kept(campaign: CampaignRuns, found: dict[str, Any]) -> dict[str, Any]:
    """The document, kept in `sensitivity.json` in place of an older one of its method and response."""
    path = campaign.folder / "sensitivity.json"
    older = (read_json(path) or {"looks": []})["looks"]
    key = (found["response"], found["method"])
    looks = [one for one in older if (one["response"], one["method"]) != key] + [found]
    write_json(path, {"looks": sorted(looks, key=lambda one: (one["response"], one["method"]))})
    return found


def _thinned(campaign: CampaignRuns, response: str) -> list[Outcome]:
    """The stored runs; of very many as many as the stage `screen` takes."""
    runs = screening_columns(campaign, {response: response_reader(response)}, names=[response])
    return [run.as_outcome() for run in runs.at(thinned(campaign, runs, response, most=MOST_RUNS))]


def _points(campaign: CampaignRuns, method: str, response: str) -> tuple[np.ndarray, np.ndarray, int]:
    """`_usable` of the runs that indices are made from: all, or of very many as many as the method bears.

    The fit of a Kriging takes those that spread. A test of independence is about runs as they were drawn: it
    takes some at random.
    """
    if method == "sobol":
        return _usable(campaign, _thinned(campaign, response), response)
    chunks = screening_chunks(campaign, names=[response])
    parts = [_usable(campaign, [run.as_outcome() for run in some], response) for some in chunks if some]
    if not parts:
        return np.empty((0, campaign.study.space.dimension)), np.empty(0), 0
    points, values, left_out = zip(*parts, strict=True)
    x, y = np.concatenate(points), np.concatenate(values)
    if method == "hsic" and len(y) > MOST_PAIRS:
        rng = stream(campaign.study.seed, "runs for hsic")
        drawn = np.sort(rng.choice(len(y), MOST_PAIRS, replace=False))
        campaign.progress.note(f"{MOST_PAIRS} of {len(y)} runs with a value are used, drawn at random")
        x, y = x[drawn], y[drawn]
    return x, y, sum(left_out)


def _usable(
    campaign: CampaignRuns, outcomes: list[Outcome], response: str
) -> tuple[np.ndarray, np.ndarray, int]:
    """Unit points (n, d) and responses (n,) of the runs with a finite value; how many have none."""
    good = [run for run in outcomes if np.isfinite(_value(run, response))]
    points = campaign.study.space.unit([run.parameters for run in good])
    return points, np.array([_value(run, response) for run in good]), len(outcomes) - len(good)


def _value(run: Outcome, response: str) -> float:
    return float(run.outputs.get(response, np.nan)) if run.status == "ok" else float("nan")


def _rivals(campaign: CampaignRuns, response: Response, transform: str) -> dict[str, Any]:
    x, y, left_out = _usable(campaign, _thinned(campaign, response.name), response.name)
    if len(y) < 5:
        raise NotEnoughRuns(f"rivals need at least 5 runs with a value of {response.name!r}, got {len(y)}")
    names, labels = campaign.study.space.names, campaign.study.space.label_columns
    screener = KrigingScreener(categorical=labels, seed=campaign.study.seed)
    try:
        scale, reason = chosen_scale(screener, x, y, transform, response.name)
        rng = stream(campaign.study.seed, "rivals")
        found = compare_rankings(x, on_scale(y, scale), categorical=labels, rng=rng)
    except ValueError as error:  # the same response in every run
        raise StudyError(f"rivals cannot rank {response.name!r}: {error}") from error
    return {
        "method": "rivals",
        "response": response.name,
        "unit": response.unit,
        "n_runs": len(y),
        "n_left_out": left_out,
        "scale": SCALES_IN_WORDS[scale] + reason if scale != "none" else "",
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


def _morris(
    campaign: CampaignRuns, response: Response, trajectories: int, transform: str | None
) -> dict[str, Any]:
    """Elementary effects; with a transform the hybrid of them and the likelihood, on that scale."""
    study = campaign.study
    if study.model["kind"] == "table":
        raise StudyError("Morris needs runs of its own, and a table cannot be run: take --method rivals")
    d, names = study.space.dimension, study.space.names
    points = morris_points(d, trajectories, rng=stream(study.seed, "morris"))
    run = campaign.evaluate(study.space.rows(points), batch="morris")
    made = [row.as_outcome() for row in with_functionals(campaign, run, [response.name])]
    values = np.array([_value(run, response.name) for run in made]).reshape(trajectories, d + 1)
    whole = np.isfinite(values).all(axis=1)  # a trajectory with a failed run gives no effects
    if not whole.any():
        raise NotEnoughRuns(f"every trajectory has a run without {response.name!r}; see `holdfast failures`")
    rows = np.repeat(whole, d + 1)
    effects = morris_effects(points[rows], values[whole].ravel())
    document = {
        "method": "morris" if transform is None else "hybrid",
        "response": response.name,
        "unit": response.unit,
        "n_runs": int(rows.sum()),
        "n_left_out": int((~rows).sum()),
        "needs": named("morris").needs,
        "cannot_see": named("morris").cannot_see,
        "ranking": [names[k] for k in effects.ranking],
        "mu": dict(zip(names, effects.mu.tolist(), strict=True)),
        "mu_star": dict(zip(names, effects.mu_star.tolist(), strict=True)),
        "sigma": {
            n: None if np.isnan(s) else float(s) for n, s in zip(names, effects.sigma.tolist(), strict=True)
        },
    }
    if transform is None:
        return document
    x, y, _ = _usable(campaign, _thinned(campaign, response.name), response.name)
    run_at = study.space.unit([run.parameters for run, kept in zip(made, rows, strict=True) if kept])
    screener = KrigingScreener(
        categorical=study.space.label_columns,
        measures=[input_measure(parameter) for parameter in study.space.parameters],
    )
    all_runs = np.concatenate([run_at, x.reshape(-1, d)]), np.concatenate([values[whole].ravel(), y])
    scale, reason = chosen_scale(screener, *all_runs, transform, response.name)
    both = hybrid_screening(
        points[rows],
        values[whole].ravel(),
        screener=screener,
        run_at=run_at,
        more_points=x if len(y) else None,
        more_y=y if len(y) else None,
        scale=scale,
    )
    judged = judged_in_names(both.screener, study.space)
    return document | {
        "stored_runs": len(y),
        "scale": SCALES_IN_WORDS[scale] + reason if scale != "none" else "",
        "selected": [names[k] for k in both.screener.selected_],
        "agreed": [names[k] for k in both.agreed],
        "disputed": [names[k] for k in both.disputed],
        "verdict": judged.verdict,
        "advice": judged.advice,
    }

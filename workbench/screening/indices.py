"""Sensitivity indices of stored runs by name: unit points and responses in, a document with names out."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from surrogates import Kriging, ScaledKriging, hsic_indices, regression_coefficients, sobol_indices
from workbench.errors import NotEnoughRuns, StudyError
from workbench.screening.named_methods import INDICES, named
from workbench.space.box import Space
from workbench.space.laws import input_law, input_measure
from workbench.space.parameter import Response
from workbench.space.streams import stream

__all__ = ["indices_document"]

MOST_PAIRED = 6  # parameters whose pairs are looked at, those of the largest total indices
PERMUTATIONS = 1000


def indices_document(
    method: str,
    x: np.ndarray,
    y: np.ndarray,
    space: Space,
    response: Response,
    *,
    transform: str | None = None,
    seed: int = 0,
) -> dict[str, Any]:
    """Indices of the parameters of `space` from unit points x (n, d) and responses y (n,), by one of INDICES.

    transform: the scale on which the Kriging of "sobol" predicts best, as in `[screen]`; None is "auto". Its
        indices are of the response on any; ranks predict nothing beyond the runs and count as none.

    Raises:
        StudyError: an unknown method, or runs that it cannot use.
        NotEnoughRuns: fewer runs than it needs.
    """
    if method not in INDICES:
        raise StudyError(f"indices need one of {', '.join(INDICES)}, got {method!r}")
    least = len(space.names) + 4 if method not in ("sobol", "hsic") else 10
    if len(y) < least:
        raise NotEnoughRuns(f"{method} needs at least {least} runs with {response.name!r}, got {len(y)}")
    try:
        found = _found(method, x, y, space, transform, seed)
    except ValueError as error:  # a response that does not vary, columns that repeat one another
        raise StudyError(f"{method} of {response.name!r}: {error}") from error
    about = named(method)
    return {
        "method": method,
        "response": response.name,
        "unit": response.unit,
        "n_runs": len(y),
        "needs": about.needs,
        "cannot_see": about.cannot_see,
        **found,
    }


def _found(
    method: str, x: np.ndarray, y: np.ndarray, space: Space, transform: str | None, seed: int
) -> dict[str, Any]:
    rng = stream(seed, f"indices {method}")
    if method == "sobol":
        return _sobol(x, y, space, transform or "auto", seed, rng)
    if method == "hsic":
        hsic = hsic_indices(x, y, categorical=space.label_columns, permutations=PERMUTATIONS, rng=rng)
        columns = {"r2_hsic": hsic.r2, "p_value": hsic.p_value}
        return _table(space.names, hsic.ranking, columns) | {"left_out": []}
    numbers = [k for k in range(len(space.names)) if k not in space.label_columns]
    names = [space.names[k] for k in numbers]
    found = regression_coefficients(x[:, numbers], y, kind=method, rng=rng)
    columns = {"value": found.value, "lower": found.lower, "upper": found.upper}
    left_out = [name for name in space.names if name not in names]
    return _table(names, found.ranking, columns) | {"r2": found.r2, "left_out": left_out}


def _sobol(
    x: np.ndarray, y: np.ndarray, space: Space, transform: str, seed: int, rng: np.random.Generator
) -> dict[str, Any]:
    d, labels = len(space.names), list(space.label_columns)
    scaled = ScaledKriging(
        scale="none" if transform == "ranks" else transform,
        kriging=Kriging(categorical=labels or None, seed=seed),
    ).fit(x, y)
    kriging, scale = scaled.kriging_, scaled.map_
    measures = [input_measure(parameter) for parameter in space.parameters]
    paired = np.arange(d)
    if d > MOST_PAIRED:
        first = sobol_indices(kriging, measures=measures, draws=20, thetas=0, carried=scale, rng=rng)
        paired = np.sort(np.argsort(-first.total.mean, kind="stable")[:MOST_PAIRED])
    pairs = [(int(i), int(j)) for at, i in enumerate(paired) for j in paired[at + 1 :]]
    found = sobol_indices(kriging, measures=measures, pairs=pairs, carried=scale, rng=rng)
    columns = {
        f"{kind}{end}": getattr(part, which)
        for kind, part in (("main", found.main), ("total", found.total))
        for end, which in (("", "mean"), ("_lower", "lower"), ("_upper", "upper"))
    }
    ranking = np.argsort(-found.total.mean, kind="stable")
    interactions = [
        {
            "pair": [space.names[i], space.names[j]],
            "mean": float(found.interaction.mean[at]),
            "lower": float(found.interaction.lower[at]),
            "upper": float(found.interaction.upper[at]),
        }
        for at, (i, j) in enumerate(found.pairs)
    ]
    return _table(space.names, ranking, columns) | {
        "q2": float(scaled.q2_),
        "scale": scale.scale,
        "correlation": kriging.correlation_,
        "trend": str(kriging.trend_),
        "interactions": sorted(interactions, key=lambda one: -float(str(one["mean"]))),
        "averaged_over": {p.name: input_law(p) for p in space.parameters},
        "left_out": [],
    }


def _table(names: Sequence[str], ranking: np.ndarray, columns: dict[str, np.ndarray]) -> dict[str, Any]:
    return {
        "ranking": [names[int(k)] for k in ranking],
        "indices": {
            name: {column: float(values[k]) for column, values in columns.items()}
            for k, name in enumerate(names)
        },
    }

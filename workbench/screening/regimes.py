"""A response that switches between two regimes: who switches it, and what drives it inside each.

Detected by the gap between the regimes (`surrogates.analysis.regimes`). The switch is a classifier of the
runs, judged on runs that it did not see, with the parameters that a screening of "is in the upper regime"
selects; inside a regime its own runs are screened.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from surrogates import KrigingScreener
from surrogates.analysis.regimes import Regimes, find_regimes
from surrogates.analysis.success import SuccessChance
from workbench.screening.in_names import shares_in_names
from workbench.space.box import Space

__all__ = ["regime_sentence", "screened_regimes"]

FOLDS = 5
CURVE_POINTS = 11
AVERAGED = 200  # points that a curve of the chance is averaged over
FEWEST_INSIDE = 10  # runs of a regime that are screened
NAMES = ("the lower regime", "the upper regime")


def screened_regimes(
    screener: KrigingScreener,
    x: np.ndarray,
    y: np.ndarray,
    space: Space,
    *,
    names: Sequence[str] | None = None,
    unit: str = "1",
    rng: np.random.Generator,
) -> dict[str, Any] | None:
    """The regimes of responses y (n,) at x (n, d) in plain types, None where one law would do.

    names: of the lower and the upper regime.   screener: as for all runs; clones of it are fitted.
    """
    found = find_regimes(y)
    if found is None:
        return None
    words = tuple(names) if names else NAMES
    regimes = []
    for name, is_inside, ends in (
        (words[0], ~found.is_upper, found.lower),
        (words[1], found.is_upper, found.upper),
    ):
        one: dict[str, Any] = {"name": name, "runs": int(is_inside.sum()), "range": list(ends)}
        regimes.append(one | _screened(screener, x[is_inside], y[is_inside], space))
    document = {
        "threshold": found.threshold,
        "gap": found.gap,
        "critical": found.critical,
        "named": names is not None,
        "regimes": regimes,
        "switch": _switch(screener, x, found, space, rng),
    }
    return document | {"sentence": regime_sentence(document, unit)}


def regime_sentence(document: dict[str, Any], unit: str) -> str:
    """Which runs are in which regime, by the names that the study gives them.

    >>> held = {"name": "held", "runs": 42, "range": [0.02, 0.4]}
    >>> gone = {"name": "left the vehicle", "runs": 18, "range": [7.9, 11.2]}
    >>> regime_sentence({"named": True, "regimes": [held, gone]}, "m")
    'of 60 runs 18 left the vehicle (7.9 to 11.2 m), 42 held (0.02 to 0.4 m), none lies between'
    >>> regime_sentence({"named": False, "regimes": [held, gone]}, "m")
    '18 of 60 runs are in another regime (7.9 to 11.2 m; the others 0.02 to 0.4)'
    """
    rare, usual = sorted(document["regimes"], key=lambda one: one["runs"])
    total, suffix = rare["runs"] + usual["runs"], "" if unit in ("", "1") else f" {unit}"
    low, high = (" to ".join(f"{value:.3g}" for value in one["range"]) for one in (rare, usual))
    if document["named"]:
        return (
            f"of {total} runs {rare['runs']} {rare['name']} ({low}{suffix}), "
            f"{usual['runs']} {usual['name']} ({high}{suffix}), none lies between"
        )
    are = "is" if rare["runs"] == 1 else "are"
    return f"{rare['runs']} of {total} runs {are} in another regime ({low}{suffix}; the others {high})"


def _screened(screener: KrigingScreener, x: np.ndarray, y: np.ndarray, space: Space) -> dict[str, Any]:
    """What drives a response inside a regime."""
    if len(y) < FEWEST_INSIDE:
        return {
            "selected": [], "minor": [], "state": "not judged", "hidden_share": None,
            "verdict": f"not judged: {len(y)} runs are too few to screen",
        }  # fmt: skip
    return shares_in_names(_another(screener).fit(x, y), space.names)


def _switch(
    screener: KrigingScreener, x: np.ndarray, found: Regimes, space: Space, rng: np.random.Generator
) -> dict[str, Any]:
    """What drives the switch, and the chance of the upper regime along each of these parameters."""
    selected = shares_in_names(_another(screener).fit(x, found.is_upper.astype(float)), space.names)
    fold = rng.permutation(len(x)) % FOLDS
    seen = np.empty(len(x))
    for k in range(FOLDS):
        seen[fold == k] = SuccessChance.of(x[fold != k], found.is_upper[fold != k]).probability(x[fold == k])
    share = float(found.is_upper.mean())
    chance = SuccessChance.of(x, found.is_upper)
    brier = float(((seen - found.is_upper) ** 2).mean())
    certain = (seen < 0.2) | (seen > 0.8)
    return selected | {
        "runs": len(x),
        "right": int(((seen > 0.5) == found.is_upper).sum()),
        "brier": brier,
        "brier_of_the_share": share * (1.0 - share),
        "certain": int(certain.sum()),
        "certain_right": int((((seen > 0.5) == found.is_upper) & certain).sum()),
        "chance": {
            name: _curve(chance, space, space.names.index(name), rng) for name in selected["selected"]
        },
    }


def _curve(chance: SuccessChance, space: Space, column: int, rng: np.random.Generator) -> dict[str, Any]:
    """Mean chance of the upper regime over the other parameters, along one of them."""
    parameter = space.parameters[column]
    count = parameter.levels_count
    at = np.linspace(0.0, 1.0, CURVE_POINTS if count is None or count > CURVE_POINTS else count)
    points = rng.random((AVERAGED, len(space.names)))
    mean = []
    for value in at:
        points[:, column] = value
        mean.append(float(chance.probability(points).mean()))
    return {"x": parameter.physical(at).tolist(), "mean": mean}


def _another(screener: KrigingScreener) -> KrigingScreener:
    """One with the same parameters, not fitted."""
    return KrigingScreener(**screener.get_params(deep=False))

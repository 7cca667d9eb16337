"""Scenarios given by a user, as points of the uncertainty."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.space.box import Space

__all__ = ["scenario_points"]


def scenario_points(uncertainty: Space, scenarios: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Unit points (m, d) of `scenarios`.

    Raises:
        StudyError: a scenario lacks a parameter, has one too many, or lies outside its bounds; says which.
    """
    points = np.empty((len(scenarios), uncertainty.dimension))
    for i, scenario in enumerate(scenarios):
        try:
            points[i] = uncertainty.unit([scenario])[0]
        except StudyError as exc:
            raise StudyError(
                f"scenario {i + 1} of {len(scenarios)} is not in the uncertainty: {exc}"
            ) from None
    return points

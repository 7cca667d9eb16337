"""What effects and Sobol' indices are averaged over: the law of each parameter, in its unit coordinate.

continuous                      uniform between the bounds (of the logarithm for scale = "log")
continuous with distribution    its density, cut off at the bounds
ordered levels                  each level with the same weight
categorical                     the labels that the runs have, each with the same weight
"""

import numpy as np

from surrogates import Measure
from surrogates.measure import discrete, uniform, weighted
from workbench.parameter import Parameter

__all__ = ["input_law", "input_measure"]

DENSITY_POINTS = 801  # of a density, linear in between
MOST_LEVELS = 200


def input_measure(parameter: Parameter) -> Measure | None:
    """The measure of a parameter on [0, 1]; None for a categorical one, whose labels the Kriging numbers."""
    if parameter.kind == "categorical":
        return None
    if (count := parameter.levels_count) is not None:
        # many levels are averaged as the continuum that they all but fill
        return discrete(np.linspace(0.0, 1.0, count)) if count <= MOST_LEVELS else uniform(0.0, 1.0)
    if parameter.distribution is None:
        return uniform(0.0, 1.0)
    u = np.linspace(0.0, 1.0, DENSITY_POINTS)
    values = parameter.physical(u)
    density = parameter.distribution.frozen().pdf(values)
    if parameter.scale == "log":
        density = density * values  # dp/du is proportional to p
    # a density may rise without limit towards a bound; what lies between two points counts by their values
    return weighted(0.0, 1.0, np.where(np.isfinite(density), density, 0.0))


def input_law(parameter: Parameter) -> str:
    """The same in words."""
    if parameter.levels_count is not None:
        return f"its {parameter.levels_count} levels, equally likely"
    if parameter.distribution is not None:
        given = ", ".join(f"{key} = {value:g}" for key, value in parameter.distribution.parameters.items())
        return f"{parameter.distribution.name}({given}) between the bounds"
    return "uniform between the bounds" + (", on a log scale" if parameter.scale == "log" else "")

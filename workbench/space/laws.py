"""What effects and Sobol' indices are averaged over: the law of each parameter, in its unit coordinate.

continuous                      uniform between the bounds (of the logarithm for scale = "log")
continuous with distribution    its density, cut off at the bounds
ordered levels                  each level with the same weight
categorical                     the labels that the runs have, each with the same weight
"""

import numpy as np

from surrogates import Measure
from surrogates.analysis.measure import discrete, uniform
from workbench.space.parameter import Parameter

__all__ = ["input_law", "input_measure"]

CELLS = 200  # of the range of a parameter with a distribution
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
    # by the chance of each cell: a density may rise without limit towards a bound
    edges = np.linspace(0.0, 1.0, CELLS + 1)
    chance = np.diff(parameter.distribution.frozen().cdf(parameter.physical(edges)))
    return Measure(points=0.5 * (edges[1:] + edges[:-1]), weights=chance / chance.sum(), low=0.0, high=1.0)


def input_law(parameter: Parameter) -> str:
    """The same in words."""
    if parameter.levels_count is not None:
        return f"its {parameter.levels_count} levels, equally likely"
    if parameter.distribution is not None:
        given = ", ".join(f"{key} = {value:g}" for key, value in parameter.distribution.parameters.items())
        return f"{parameter.distribution.name}({given}) between the bounds"
    return "uniform between the bounds" + (", on a log scale" if parameter.scale == "log" else "")

"""Points in the unit cube: samplers, exchange algorithms and the quality of a design."""

from doe.classical import (
    box_behnken,
    central_composite,
    full_factorial,
    orthogonal_array,
    plackett_burman,
    resolution,
    two_level_fraction,
)
from doe.coordinate_exchange import coordinate_exchange
from doe.d_optimal import d_optimal_best_of, d_optimal_select, d_optimal_within
from doe.exchange import exchange
from doe.models import (
    a_efficiency,
    d_efficiency,
    g_efficiency,
    i_efficiency,
    model_matrix,
    model_terms,
    variance_inflation,
)

__distribution__ = "holdfast"

__all__ = [
    "a_efficiency",
    "box_behnken",
    "central_composite",
    "coordinate_exchange",
    "d_efficiency",
    "d_optimal_best_of",
    "d_optimal_select",
    "d_optimal_within",
    "exchange",
    "full_factorial",
    "g_efficiency",
    "i_efficiency",
    "model_matrix",
    "model_terms",
    "orthogonal_array",
    "plackett_burman",
    "resolution",
    "two_level_fraction",
    "variance_inflation",
]

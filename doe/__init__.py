"""Points in the unit cube: samplers, exchange algorithms and the quality of a design."""

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
    "coordinate_exchange",
    "d_efficiency",
    "d_optimal_best_of",
    "d_optimal_select",
    "d_optimal_within",
    "exchange",
    "g_efficiency",
    "i_efficiency",
    "model_matrix",
    "model_terms",
    "variance_inflation",
]

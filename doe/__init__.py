"""Points in the unit cube: samplers, exchange algorithms and the quality of a design."""

from doe.d_optimal import d_optimal_select
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
    "d_efficiency",
    "d_optimal_select",
    "g_efficiency",
    "i_efficiency",
    "model_matrix",
    "model_terms",
    "variance_inflation",
]

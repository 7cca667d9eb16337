"""Kriging by restricted maximum likelihood, screening of inputs and validation.

Public names are loaded on first use.
"""

from importlib import import_module
from typing import Any

__distribution__ = "holdfast"

# public name -> module that defines it
_PUBLIC: dict[str, str] = {
    "random_function": "surrogates.planning",
    "wilson_interval": "surrogates.planning",
    "recovery": "surrogates.planning",
    "Recovery": "surrogates.planning",
    "compare_rankings": "surrogates.rivals",
    "Ranking": "surrogates.rivals",
    "hybrid_screening": "surrogates.hybrid",
    "HybridScreening": "surrogates.hybrid",
    "morris_points": "surrogates.morris",
    "morris_effects": "surrogates.morris",
    "MorrisEffects": "surrogates.morris",
    "selected_kriging": "surrogates.metamodel",
    "selection_stability": "surrogates.stability",
    "ScreeningDiagnosis": "surrogates.verdict",
    "fewest_runs": "surrogates.verdict",
    "ScreeningStep": "surrogates.screening",
    "restricted_log_likelihood": "surrogates.reml",
    "profiled_log_likelihood": "surrogates.reml",
    "ProfiledLikelihood": "surrogates.reml",
    "KrigingScreener": "surrogates.screening",
    "Correlation": "surrogates.correlation",
    "Diagnosis": "surrogates.diagnosis",
    "Effect": "surrogates.effects",
    "Kriging": "surrogates.kriging",
    "LeaveOneOut": "surrogates.validation",
    "Measure": "surrogates.measure",
    "NotPositiveDefinite": "surrogates.errors",
    "SharedKriging": "surrogates.responses",
    "SobolIndices": "surrogates.sobol",
    "TooFewRuns": "surrogates.errors",
    "TrendChoice": "surrogates.trend_choice",
    "accumulated_local_effect": "surrogates.effects",
    "choose_trend": "surrogates.trend_choice",
    "main_effects": "surrogates.effects",
    "partial_dependence": "surrogates.effects",
    "sobol_indices": "surrogates.sobol",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'surrogates' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__

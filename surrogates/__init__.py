"""Kriging by restricted maximum likelihood, screening of inputs and validation.

Public names are loaded on first use.
"""

from importlib import import_module
from typing import Any

__distribution__ = "holdfast"

# public name -> module that defines it
_PUBLIC: dict[str, str] = {
    "random_function": "surrogates.screening.planning",
    "wilson_interval": "surrogates.screening.planning",
    "recovery": "surrogates.screening.planning",
    "Recovery": "surrogates.screening.planning",
    "compare_rankings": "surrogates.screening.rivals",
    "Ranking": "surrogates.screening.rivals",
    "hybrid_screening": "surrogates.screening.hybrid",
    "HybridScreening": "surrogates.screening.hybrid",
    "morris_points": "surrogates.screening.morris",
    "morris_effects": "surrogates.screening.morris",
    "MorrisEffects": "surrogates.screening.morris",
    "selected_kriging": "surrogates.screening.metamodel",
    "selection_stability": "surrogates.screening.stability",
    "RESPONSE_SCALES": "surrogates.analysis.response_map",
    "ResponseMap": "surrogates.analysis.response_map",
    "response_map": "surrogates.analysis.response_map",
    "ScaleChoice": "surrogates.screening.response_scale",
    "choose_scale": "surrogates.screening.response_scale",
    "judged_on_response": "surrogates.screening.response_scale",
    "left_out_share": "surrogates.screening.response_scale",
    "on_scale": "surrogates.screening.response_scale",
    "Judgement": "surrogates.screening.verdict",
    "ScreeningDiagnosis": "surrogates.screening.verdict",
    "fewest_runs": "surrogates.screening.verdict",
    "ScreeningStep": "surrogates.screening.screener",
    "restricted_log_likelihood": "surrogates.likelihood.restricted",
    "profiled_log_likelihood": "surrogates.likelihood.restricted",
    "ProfiledLikelihood": "surrogates.likelihood.restricted",
    "KrigingScreener": "surrogates.screening.screener",
    "Correlation": "surrogates.likelihood.correlation",
    "Diagnosis": "surrogates.kriging.diagnosis",
    "Effect": "surrogates.analysis.effects",
    "Kriging": "surrogates.kriging.estimator",
    "LeaveOneOut": "surrogates.kriging.validation",
    "Measure": "surrogates.analysis.measure",
    "NotPositiveDefinite": "surrogates.errors",
    "ScaledKriging": "surrogates.analysis.scaled_kriging",
    "SharedKriging": "surrogates.kriging.responses",
    "SobolIndices": "surrogates.analysis.sobol",
    "TooFewRuns": "surrogates.errors",
    "TrendChoice": "surrogates.kriging.trend_choice",
    "accumulated_local_effect": "surrogates.analysis.effects",
    "choose_trend": "surrogates.kriging.trend_choice",
    "main_effects": "surrogates.analysis.effects",
    "FormScore": "surrogates.kriging.form_choice",
    "HsicIndices": "surrogates.analysis.dependence",
    "REGRESSION_KINDS": "surrogates.analysis.regression",
    "RegressionCoefficients": "surrogates.analysis.regression",
    "hsic_indices": "surrogates.analysis.dependence",
    "regression_coefficients": "surrogates.analysis.regression",
    "are_kernels_compiled": "surrogates.compiling",
    "compile_kernels": "surrogates.compiling",
    "partial_dependence": "surrogates.analysis.effects",
    "sobol_indices": "surrogates.analysis.sobol",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'surrogates' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__

"""Points in the unit cube: samplers, exchange algorithms and the quality of a design.

Public names are loaded on first use, so `import doe` costs nothing.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from doe.classical import (
        box_behnken,
        central_composite,
        full_factorial,
        orthogonal_array,
        plackett_burman,
        resolution,
        two_level_fraction,
    )
    from doe.criteria.metrics import projection_cd2
    from doe.criteria.regression import (
        a_efficiency,
        d_efficiency,
        g_efficiency,
        i_efficiency,
        model_matrix,
        model_terms,
        variance_inflation,
    )
    from doe.criteria.spread import (
        cd2,
        correlations,
        discrepancies,
        max_correlation,
        maxpro,
        min_distance,
        nearest_distances,
        phi_p,
        rms_correlation,
    )
    from doe.latin.augment import augment, nested_lhs, search_augmentation, search_rearrangement
    from doe.latin.decorrelated import decorrelated_lhs
    from doe.latin.ihs import (
        auto_spacing,
        ihs,
        ihs_cells,
        published_spacing,
    )
    from doe.latin.levels import balanced_levels, optimised_levels, rearrange
    from doe.latin.lhs import centred_lhs, lhs
    from doe.latin.optimised import optimised_lhs, search_lhs
    from doe.latin.sliced import sliced_lhs
    from doe.latin.swaps import SwapResult
    from doe.optimal.coordinate_exchange import coordinate_exchange
    from doe.optimal.d_optimal import d_optimal_best_of, d_optimal_select, d_optimal_within
    from doe.optimal.exchange import exchange
    from doe.quality import Quality, quality
    from doe.running import blocks, replicates, run_order
    from doe.sequences import halton, oa_lhs, sobol
    from doe.subset import subset

__distribution__ = "holdfast"

__all__ = [
    "Quality",
    "SwapResult",
    "a_efficiency",
    "augment",
    "auto_spacing",
    "balanced_levels",
    "blocks",
    "box_behnken",
    "cd2",
    "central_composite",
    "centred_lhs",
    "coordinate_exchange",
    "correlations",
    "d_efficiency",
    "d_optimal_best_of",
    "d_optimal_select",
    "d_optimal_within",
    "decorrelated_lhs",
    "discrepancies",
    "exchange",
    "full_factorial",
    "g_efficiency",
    "halton",
    "i_efficiency",
    "ihs",
    "ihs_cells",
    "lhs",
    "max_correlation",
    "maxpro",
    "min_distance",
    "model_matrix",
    "model_terms",
    "nearest_distances",
    "nested_lhs",
    "oa_lhs",
    "optimised_levels",
    "optimised_lhs",
    "orthogonal_array",
    "phi_p",
    "plackett_burman",
    "projection_cd2",
    "published_spacing",
    "quality",
    "rearrange",
    "replicates",
    "resolution",
    "rms_correlation",
    "run_order",
    "search_augmentation",
    "search_lhs",
    "search_rearrangement",
    "sliced_lhs",
    "sobol",
    "subset",
    "two_level_fraction",
    "variance_inflation",
]

# module -> public names that it defines
_MODULES = {
    "latin.augment": ("augment", "nested_lhs", "search_augmentation", "search_rearrangement"),
    "classical": (
        "box_behnken",
        "central_composite",
        "full_factorial",
        "orthogonal_array",
        "plackett_burman",
        "resolution",
        "two_level_fraction",
    ),
    "optimal.coordinate_exchange": ("coordinate_exchange",),
    "optimal.d_optimal": ("d_optimal_best_of", "d_optimal_select", "d_optimal_within"),
    "latin.decorrelated": ("decorrelated_lhs",),
    "optimal.exchange": ("exchange",),
    "latin.ihs": ("auto_spacing", "ihs", "ihs_cells", "published_spacing"),
    "latin.levels": ("balanced_levels", "optimised_levels", "rearrange"),
    "latin.lhs": ("centred_lhs", "lhs"),
    "criteria.spread": (
        "cd2",
        "correlations",
        "discrepancies",
        "max_correlation",
        "maxpro",
        "min_distance",
        "nearest_distances",
        "phi_p",
        "rms_correlation",
    ),
    "criteria.metrics": ("projection_cd2",),
    "criteria.regression": (
        "a_efficiency",
        "d_efficiency",
        "g_efficiency",
        "i_efficiency",
        "model_matrix",
        "model_terms",
        "variance_inflation",
    ),
    "latin.optimised": ("optimised_lhs", "search_lhs"),
    "quality": ("Quality", "quality"),
    "running": ("blocks", "replicates", "run_order"),
    "sequences": ("halton", "oa_lhs", "sobol"),
    "latin.sliced": ("sliced_lhs",),
    "subset": ("subset",),
    "latin.swaps": ("SwapResult",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


class _Package(ModuleType):
    """This package: importing the module `doe.lhs` must not hide the function `lhs`."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):  # the import system binds submodules here
            super().__setattr__(name, value)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'doe' has no attribute {name!r}")
    value = getattr(import_module(f"doe.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


sys.modules[__name__].__class__ = _Package

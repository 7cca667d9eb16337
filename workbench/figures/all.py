"""The figures of a campaign in one place: data in, axes out, labelled with units.

Every function draws on `ax` (the current axes without one) and returns it; none of them shows, saves or sizes
a figure. `plt.style.use("workbench.style")` gives the look of the report. The data are the mappings of the
campaign's documents (`screening.json`, `worst_case.json`), so `plot_waterfall(json.load(f)["path"])` works.
"""

from workbench.figures.fit import plot_predicted, plot_quantiles, plot_standardised
from workbench.figures.layout import (
    plot_density,
    plot_front,
    plot_layout,
    plot_layout_history,
)
from workbench.figures.loop import (
    plot_convergence,
    plot_differences,
    plot_distributions,
    plot_history,
    plot_layout_matrix,
    plot_members,
    plot_rounds,
)
from workbench.figures.runs import plot_failures, plot_percentiles, plot_response
from workbench.figures.screening import (
    plot_likelihood_path,
    plot_main_effect,
    plot_theta,
    plot_waterfall,
)
from workbench.figures.worst_case import (
    plot_baselines,
    plot_gap_share,
    plot_gap_to_bound,
    plot_parallel,
    plot_profile,
    plot_search,
    plot_surprise,
)

__all__ = [
    "plot_baselines",
    "plot_convergence",
    "plot_density",
    "plot_differences",
    "plot_distributions",
    "plot_failures",
    "plot_front",
    "plot_gap_share",
    "plot_gap_to_bound",
    "plot_history",
    "plot_layout",
    "plot_layout_history",
    "plot_layout_matrix",
    "plot_likelihood_path",
    "plot_main_effect",
    "plot_members",
    "plot_parallel",
    "plot_percentiles",
    "plot_predicted",
    "plot_profile",
    "plot_quantiles",
    "plot_response",
    "plot_rounds",
    "plot_search",
    "plot_standardised",
    "plot_surprise",
    "plot_theta",
    "plot_waterfall",
]

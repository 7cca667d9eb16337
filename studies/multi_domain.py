"""Two design domains with a budget each, (7.18): the members of body 1 and those of body 3.

Figures like 7.12 to 7.14. A second budget can only cost: its layout is no better than the one with the same
material free to move between the domains. `python -m studies.multi_domain` prints both.
"""

from typing import TYPE_CHECKING

import xarray as xr

from studies import three_body_layout

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from workbench.engine.layout.formulation.problem import LayoutProblem

__all__ = ["figures", "problem", "run"]


def problem(*, share: float = 0.1) -> "LayoutProblem":
    """The three-body layout with a budget per domain.

    >>> problem().names
    ('body 1', 'body 3')
    """
    return three_body_layout.problem(domains=2, share=share)


def run(*, evaluations: int = 50) -> xr.Dataset:
    """Best values, densities, shadow price of each budget."""
    return three_body_layout.run(domains=2, evaluations=evaluations)


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """History, density and layout."""
    return three_body_layout.figures(ds)


if __name__ == "__main__":
    three_body_layout.main(domains=2, name="multi_domain")

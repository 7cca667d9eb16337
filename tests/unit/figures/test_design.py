"""Figures of a design: they draw what they are asked for and label it."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from workbench.errors import StudyError
from workbench.figures.design import (
    plot_correlations,
    plot_distances,
    plot_pair,
    plot_pairs,
)
from workbench.sampling.plan import make_design
from workbench.space.box import Parameter, Space


@pytest.fixture
def design():
    space = Space(
        [
            Parameter("k", lower=1, upper=100, unit="N/m", scale="log"),
            Parameter("n", kind="integer", lower=1, upper=4),
            Parameter("x", lower=-1, upper=1, label="offset", unit="mm"),
        ]
    )
    return make_design(space, "lhs", 12, seed=1)


def test_a_pair_shows_every_run_in_physical_values(design):
    ax = plot_pair(design, "k", "x")
    np.testing.assert_allclose(ax.collections[0].get_offsets()[:, 0], design.physical[:, 0])
    assert ax.get_xlabel() == "k [N/m]"
    assert ax.get_ylabel() == "offset [mm]"
    assert ax.get_xscale() == "log"
    assert len(ax.lines) == 26  # the edges of 12 strata, both ways


def test_all_pairs_are_drawn_in_one_frame(design):
    ax = plot_pairs(design, ax=Figure().add_subplot())
    assert len(ax.collections) == 3
    assert [t.get_text() for t in ax.get_xticklabels()] == ["k", "n", "x"]


def test_the_correlation_map_shows_the_matrix(design):
    ax = plot_correlations(design)
    matrix = np.corrcoef(design.unit.T)
    shown = ax.images[0].get_array()
    assert shown[0, 1] == pytest.approx(matrix[0, 1])
    assert {t.get_text() for t in ax.texts} >= {f"{matrix[0, 1]:.2f}"}


def test_distances_are_compared_with_a_random_design(design):
    ax = plot_distances(design)
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["random Latin hypercube", "lhs"]
    with pytest.raises(StudyError, match="distances need at least two runs"):
        plot_distances(design.subset([0]))


def test_too_many_pairs_are_refused():
    space = Space([Parameter(f"x{k}", lower=0, upper=1) for k in range(13)])
    with pytest.raises(StudyError, match="all pairs of 13 parameters are too many"):
        plot_pairs(make_design(space, "lhs", 5))

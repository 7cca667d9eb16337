"""Figures of layouts in turn with worst cases."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from workbench.figures.loop import plot_layout_matrix, plot_members


def member(kind, density, shift):
    return {"kind": kind, "density": density, "a": (0.0, shift), "b": (1.0, shift)}


@pytest.fixture
def axes():
    figure, ax = plt.subplots()
    yield ax
    plt.close(figure)


def test_the_legend_shows_the_thickest_member_of_each_kind(axes):
    members = [member("belt", 1.0, 0.0), member("belt", 0.01, 0.1), member("airbag", 0.5, 0.2)]
    plot_members(members, ax=axes)
    belt, airbag = axes.get_lines()[-1], axes.get_lines()[-2]
    shown = dict(
        zip(
            [t.get_text() for t in axes.get_legend().get_texts()],
            axes.get_legend().legend_handles,
            strict=True,
        )
    )
    assert set(shown) == {"belt", "airbag"}
    assert shown["belt"].get_linewidth() == belt.get_linewidth() > 1.0
    assert shown["airbag"].get_linewidth() == airbag.get_linewidth() > 2.0


def test_nothing_is_shown_without_members(axes):
    plot_members([], ax=axes)
    assert axes.get_legend() is None


def test_members_that_look_as_wide_are_one_line(axes):
    """A page of hundreds of members is smaller by it, and each still stands where it is."""
    members = [member("belt", 0.501 + 1e-4 * k, 0.1 * k) for k in range(20)]
    plot_members([*members, member("belt", 1.0, 9.0)], ax=axes)
    thick, thin = sorted(axes.get_lines(), key=lambda line: len(line.get_xdata()))
    ends = thin.get_xydata().reshape(20, 3, 2)
    assert np.isnan(ends[:, 2]).all()
    np.testing.assert_allclose(ends[:, :2, 1], [[0.1 * k] * 2 for k in range(20)])
    assert thin.get_linewidth() == pytest.approx(thick.get_linewidth() / 2, abs=0.051)


def test_the_area_of_a_square_is_the_density(axes):
    plot_layout_matrix(
        np.array([[1.0, 0.25, 0.0], [0.25, np.nan, 0.5]]), rows=["a", "b"], columns=["c", "d", "e"], ax=axes
    )
    dots, *squares = axes.get_lines()
    assert len(dots.get_xdata()) == 5
    areas = {line.get_markersize() ** 2: len(line.get_xdata()) for line in squares}
    assert [area / max(areas) for area in areas] == pytest.approx([0.25, 0.5, 1.0], abs=0.01)
    assert list(areas.values()) == [2, 1, 1]

"""Figures of layouts in turn with worst cases."""

import matplotlib.pyplot as plt
import pytest

from workbench.figures.loop import plot_members


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
    assert shown["airbag"].get_markersize() == airbag.get_markersize()


def test_nothing_is_shown_without_members(axes):
    plot_members([], ax=axes)
    assert axes.get_legend() is None

"""The figures of a campaign show what the documents say, with units, and draw where they are told."""

import importlib
import inspect
import pkgutil

import matplotlib.pyplot as plt
import numpy as np
import pytest

import workbench.figures
import workbench.figures.all as door
from workbench.figures import (
    fit as fit_plots,
)
from workbench.figures import (
    layout as layout_plots,
)
from workbench.figures import (
    loop as loop_plots,
)
from workbench.figures import (
    runs as run_plots,
)
from workbench.figures import (
    screening as screening_plots,
)
from workbench.figures import (
    worst_case as worst_case_plots,
)
from workbench.figures.parts import axis_label, current_axes, text_where_no_math, whole_numbers
from workbench.report.page.drawing import draw_svg

PATH = [
    {"added": ["a"], "log_likelihood": -40.0, "gain": 9.0, "accepted": True},
    {"added": ["c"], "log_likelihood": -36.0, "gain": 4.0, "accepted": True},
    {"added": ["b"], "log_likelihood": -35.5, "gain": 0.5, "accepted": False},
]
LEFT_OUT = {
    "true": [1.0, 2.0, 3.0, 9.0], "predicted": [1.1, 2.1, 2.9, 4.0], "std": [0.2, 0.2, 0.2, 0.5],
    "standardised": [-0.5, -0.5, 0.5, 10.0],
}  # fmt: skip


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


def test_the_door_holds_every_figure_of_every_stage():
    rooms = (fit_plots, layout_plots, loop_plots, run_plots, screening_plots, worst_case_plots)
    held = {name for room in rooms for name in room.__all__ if name.startswith("plot_")}
    assert set(door.__all__) == held
    assert all(getattr(door, name) is not None for name in held)


def test_parts(ax):
    assert axis_label("load", "kN") == "load [kN]"
    assert axis_label("share") == "share"
    assert current_axes(ax) is ax
    assert current_axes(None) is plt.gca()
    assert all(tick == round(tick) for tick in whole_numbers().tick_values(0, 7))


def test_a_waterfall_has_a_bar_for_every_step_and_tells_rejected_ones(ax):
    assert screening_plots.plot_waterfall(PATH, ax=ax) is ax
    bars = [patch for patch in ax.patches if patch.get_height()]
    assert [round(bar.get_height(), 9) for bar in bars][-3:] == [9.0, 4.0, 0.5]
    assert [bool(bar.get_hatch()) for bar in bars][-3:] == [False, False, True]


def test_runs_outside_their_interval_are_marked_apart(ax):
    fit_plots.plot_standardised(LEFT_OUT, ax=ax)
    inside, outside = (line for line in ax.lines if line.get_linestyle() == "None")
    assert list(inside.get_ydata()) == [-0.5, -0.5, 0.5]
    assert list(outside.get_ydata()) == [10.0]
    assert inside.get_marker() != outside.get_marker()


def test_shares_below_half_differ_in_colour(ax):
    quality = {
        "phi_p": {"percentile": 20.0, "better": "low"},
        "cd2": {"percentile": 20.0, "better": "high"},
    }
    run_plots.plot_percentiles(quality, ax=ax)
    better, worse = ax.patches
    assert (better.get_width(), worse.get_width()) == (80.0, 20.0)
    assert better.get_facecolor() != worse.get_facecolor()


def test_what_the_search_bought_stands_on_one_axis(ax):
    found = {"this search": 4.0, "grid": 3.0, "random corners": 3.5}
    worst_case_plots.plot_baselines(found, label="force", unit="N", ax=ax)
    assert sorted(float(np.ravel(line.get_xdata())[0]) for line in ax.lines if line.get_marker() in "oD") == [
        3.0, 3.5, 4.0,
    ]  # fmt: skip
    assert ax.get_xlabel() == "worst force found [N]"


LOOKS = [
    {"runs": 3, "upper": 6.0, "width": 3.0, "share": 1.0, "full": False},
    {"runs": 4, "upper": 5.0, "width": 1.0, "share": 0.25, "full": False},
    {"runs": 5, "upper": 4.0, "width": 0.0, "share": 0.0, "full": True},
]


def test_the_bound_comes_down_on_the_worst_so_far(ax):
    history = [{"best": best} for best in (None, 2.0, 3.0, 4.0, 4.0)]
    worst_case_plots.plot_gap_to_bound(LOOKS, history=history, label="force", unit="N", ax=ax)
    lines = {line.get_label(): line for line in ax.lines}
    assert lines["worst so far"].get_xydata().tolist() == [[3.0, 3.0], [4.0, 4.0], [5.0, 4.0]]
    assert lines["bound"].get_xydata().tolist() == [[5.0, 4.0]]
    assert lines["bound, quick look"].get_xydata().tolist() == [[3.0, 6.0], [4.0, 5.0]]
    assert ax.get_ylabel() == "force [N]"


def test_a_profile_over_few_levels_has_them_as_ticks(ax):
    profile = {"x": [0, 1], "mean": [1.0, 2.0], "lower": [0.5, 1.5], "upper": [1.5, 2.5]}
    worst_case_plots.plot_profile(profile, name="belt", worst=1, value=2.0, confirmed=True, ax=ax)
    assert ax.get_xticks().tolist() == [0, 1]


def test_a_closed_gap_is_marked_on_a_logarithmic_axis(ax):
    worst_case_plots.plot_gap_share(LOOKS, ax=ax)
    assert ax.get_yscale() == "log"
    closed = next(line for line in ax.lines if line.get_label() == "closed")
    assert closed.get_xdata() == [5]


@pytest.mark.parametrize("label", ["cost in $ or $_", "$\\frac{1}$ N", "$x^2$ and $y_{$"])
def test_a_label_that_is_no_mathtext_is_drawn_as_text(label):
    svg = draw_svg(lambda ax: ax.set_xlabel(label), width=2, height=1, name="n")
    assert "<svg" in svg


def test_a_label_that_is_mathtext_stays_mathematics():
    from matplotlib.figure import Figure

    figure = Figure()
    ax = figure.add_subplot()
    ax.set_xlabel("$x^2$")
    ax.set_ylabel("$x^{$")
    text_where_no_math(figure)
    assert ax.xaxis.label.get_parse_math()
    assert not ax.yaxis.label.get_parse_math()


PLOTS = [
    (module.name, name)
    for module in pkgutil.iter_modules(workbench.figures.__path__)
    for name, value in vars(importlib.import_module(f"workbench.figures.{module.name}")).items()
    if name.startswith("plot_") and inspect.isfunction(value)
]


@pytest.mark.parametrize(("module", "name"), PLOTS)
def test_every_plot_takes_any_label(module, name):
    plot = getattr(importlib.import_module(f"workbench.figures.{module}"), name)
    assert plot.__wrapped__.__name__ == name


@pytest.mark.parametrize("label", ["cost in $ or $_", "$\\frac{1}$ N"])
def test_a_plot_with_a_label_that_is_no_mathtext_can_be_saved(label, tmp_path):
    from matplotlib.figure import Figure

    figure = Figure()
    one, two = figure.subplots(2)
    assert run_plots.plot_response([1.0, None, 2.0], stages=[label] * 3, label=label, ax=one) is one
    run_plots.plot_failures([label], passed=np.zeros((2, 1)), failed=np.ones((1, 1)), ax=two)
    figure.savefig(tmp_path / "plot.svg")
    assert (tmp_path / "plot.svg").stat().st_size > 0


def test_no_two_kinds_of_runs_are_drawn_alike():
    kinds = ["given", "ei", "ucb", "trust", "corner", "predicted", *(f"attack: {k}" for k in range(12))]
    history = [
        {"proposal": kind, "value": float(k), "best": float(k), "run_key": f"k{k}"}
        for k, kind in enumerate(kinds)
    ]
    ax = worst_case_plots.plot_search(history, ax=plt.figure().subplots())
    drawn = {line.get_label(): (line.get_marker(), line.get_color()) for line in ax.lines[1:]}
    assert set(drawn) == set(kinds)
    assert len(set(drawn.values())) == len(kinds)

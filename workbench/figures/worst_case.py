"""Figures of a worst-case search: data in, axes out, as in `workbench.figures.all`.

Proposals differ by marker as well as colour, the confirming run by a ring.
"""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.figures.parts import (
    BLUE,
    GREEN,
    GREY,
    NORMAL_95,
    ORANGE,
    PALE,
    PURPLE,
    VERMILLION,
    any_label,
    axis_label,
    current_axes,
    whole_numbers,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "plot_baselines",
    "plot_gap_share",
    "plot_gap_to_bound",
    "plot_parallel",
    "plot_profile",
    "plot_search",
    "plot_surprise",
]


MARKERS = {
    "given": ("o", PALE),
    "start": ("o", GREY),
    "ucb": ("D", BLUE),
    "predicted": ("d", BLUE),
    "ei": ("s", GREEN),
    "corner": ("^", PURPLE),
    "trust": ("v", ORANGE),
}
OTHER_MARKERS = "Pp*hX<>"
BARS_BEYOND = 0.6  # of the range of true values: how far bars are drawn beyond it
MOST_LEVELS = 7  # of an input that are told one by one on its axis


@any_label
def plot_search(
    history: Sequence[Mapping[str, Any]],
    *,
    run_key: str | None = None,
    run_label: str = "confirming run",
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """True values of the search in the order run, by what proposed them, with the worst so far as a stair.

    The run of `run_key` is ringed and named `run_label`.
    """
    ax = current_axes(ax)
    number = np.arange(1, len(history) + 1)
    best = np.array([np.nan if h.get("best") is None else h["best"] for h in history], dtype=float)
    ax.step(number, best, where="post", color="#1b1f24", lw=1.1, label="worst so far", zorder=1)
    kinds = list(dict.fromkeys(str(h.get("proposal", "run")) for h in history))
    # an attack adds kinds of its own to those of the search: where markers begin again, the colour is another
    others = cycle((marker, colour) for colour in (VERMILLION, PURPLE, GREEN) for marker in OTHER_MARKERS)
    for kind in kinds:
        marker, colour = MARKERS.get(kind) or next(others)
        some = [
            (k, h["value"]) for k, h in zip(number, history, strict=True)
            if str(h.get("proposal", "run")) == kind and h.get("value") is not None
        ]  # fmt: skip
        if some:
            ax.plot(*zip(*some, strict=True), marker, color=colour, mfc="none", label=kind, zorder=2)
    ringed = [
        (k, h["value"]) for k, h in zip(number, history, strict=True)
        if run_key is not None and h.get("run_key") == run_key and h.get("value") is not None
    ]  # fmt: skip
    if ringed:
        ax.plot(*ringed[0], "o", ms=12, mfc="none", mec=VERMILLION, mew=1.8, label=run_label, zorder=3)
    ax.xaxis.set_major_locator(whole_numbers())
    ax.set(xlabel="run", ylabel=axis_label(label, unit))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


@any_label
def plot_gap_to_bound(
    looks: Sequence[Mapping[str, Any]],
    *,
    history: Sequence[Mapping[str, Any]],
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """The worst so far and, over the same runs, the bound that was stated, as stairs; the gap is shaded.

    `looks` are `WorstCase.gap_history` as mappings, `history` the runs; quick looks are open dots.
    """
    ax = current_axes(ax)
    begin = max(min(look["runs"] for look in looks), 1)
    seen = [
        (k, h["best"]) for k, h in enumerate(history, start=1) if k >= begin and h.get("best") is not None
    ]
    bound = [(look["runs"], look["upper"]) for look in looks]
    best = dict(seen)
    ax.fill_between(
        [k for k, _ in bound], [u for _, u in bound], [best.get(k, u) for k, u in bound],
        step="post", color=BLUE, alpha=0.15, lw=0,
    )  # fmt: skip
    ax.step(*zip(*bound, strict=True), where="post", color=BLUE, lw=0.9)
    _looks(ax, looks, "upper")
    ax.step(*zip(*seen, strict=True), where="post", color="#1b1f24", lw=1.1, label="worst so far", zorder=3)
    ax.xaxis.set_major_locator(whole_numbers())
    ax.set(xlabel="run", ylabel=axis_label(label, unit))
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


@any_label
def plot_gap_share(looks: Sequence[Mapping[str, Any]], *, ax: "Axes | None" = None) -> "Axes":
    """The stated gap as percent of the range of the values seen by then; a gap of nothing is a triangle."""
    ax = current_axes(ax)
    known = [{**look, "percent": 100.0 * look["share"]} for look in looks if look["share"] is not None]
    open_ = [look for look in known if look["percent"] > 0]
    ax.plot([look["runs"] for look in open_], [look["percent"] for look in open_], color=BLUE, lw=0.9)
    _looks(ax, open_, "percent")
    closed = [look["runs"] for look in known if look["percent"] <= 0]
    if open_:
        ax.set_yscale("log")
    if closed:
        ax.plot(
            closed, [0.02] * len(closed), "v", color=GREEN, transform=ax.get_xaxis_transform(), label="closed"
        )
        ax.legend(loc="upper right")
    ax.xaxis.set_major_locator(whole_numbers())
    ax.set(xlabel="run", ylabel="gap, % of the range seen")
    return ax


def _looks(ax: "Axes", looks: Sequence[Mapping[str, Any]], value: str) -> None:
    """Filled dots for full looks, open ones for quick looks."""
    for full, name in ((True, "bound"), (False, "bound, quick look")):
        some = [(look["runs"], look[value]) for look in looks if look["full"] == full]
        if some:
            ax.plot(
                *zip(*some, strict=True), "o", color=BLUE, ms=5 if full else 3.5,
                mfc=BLUE if full else "white", label=name, zorder=4,
            )  # fmt: skip


@any_label
def plot_surprise(
    history: Sequence[Mapping[str, Any]],
    *,
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """What the Kriging expected before each run, with its 95 % bar, and what the run gave."""
    ax = current_axes(ax)
    known = [h for h in history if h.get("predicted") is not None and h.get("value") is not None]
    number = [h.get("iteration", k) for k, h in enumerate(known)]
    bar = [NORMAL_95 * float(h.get("predicted_std") or 0.0) for h in known]
    ax.errorbar(
        number, [h["predicted"] for h in known], yerr=bar, fmt="_", color=GREY, capsize=2, elinewidth=0.9,
        label="predicted, 95 % bar",
    )  # fmt: skip
    ax.plot(number, [h["value"] for h in known], "o", color=VERMILLION, ms=4, label="true run")
    ax.xaxis.set_major_locator(whole_numbers())
    ax.set(xlabel="run", ylabel=axis_label(label, unit), ylim=_around([h["value"] for h in known]))
    ax.legend(loc="best")
    return ax


def _around(values: Sequence[float]) -> tuple[float | None, float | None]:
    """Ends of an axis that holds true values, and bars as far as they say something beside these."""
    if not values or min(values) == max(values):
        return None, None
    span = max(values) - min(values)
    return min(values) - BARS_BEYOND * span, max(values) + BARS_BEYOND * span


@any_label
def plot_profile(
    profile: Mapping[str, Sequence[Any]],
    *,
    name: str,
    unit: str = "1",
    worst: Any,
    value: float,
    confirmed: bool,
    runs: Sequence[tuple[Any, float]] = (),
    response: str = "response",
    response_unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """The response along one input through the worst case, 95 % band, true runs and the confirming one.

    `runs` are all true runs as (input, response): they do not lie on this line, so they are drawn pale.
    """
    ax = current_axes(ax)
    x = list(profile["x"])
    words = not all(isinstance(v, (int, float)) for v in [*x, worst])
    place: dict[Any, float] = {v: float(k) for k, v in enumerate(x)} if words else {}

    def at(v: Any) -> float:
        return place.get(v, np.nan) if words else float(v)

    if runs:
        ax.plot([at(v) for v, _ in runs], [y for _, y in runs], "o", color=PALE, ms=3, zorder=1)
    line = [at(v) for v in x]
    ax.fill_between(line, profile["lower"], profile["upper"], color=BLUE, alpha=0.18, lw=0)
    ax.plot(line, profile["mean"], "o-" if words or len(x) <= MOST_LEVELS else "-", color=BLUE)
    ax.plot(
        at(worst), value, "o", ms=9, mew=1.8, mec=VERMILLION, mfc=VERMILLION if confirmed else "white",
        zorder=4, clip_on=False,
    )  # fmt: skip
    if words:
        ax.set_xticks(range(len(x)), [str(v) for v in x])
    elif len(x) <= MOST_LEVELS:
        ax.set_xticks(x)
    ax.set(xlabel=axis_label(name, unit), ylabel=axis_label(response, response_unit))
    return ax


@any_label
def plot_parallel(
    unit_points: np.ndarray,
    *,
    values: np.ndarray,
    names: Sequence[str],
    worst: int,
    ticks: Sequence[Mapping[float, str]] = (),
    ax: "Axes | None" = None,
) -> "Axes":
    """Runs (n, d) in the unit cube as lines over the inputs; the worst of the `values` (n,) in front.

    The tenth of the runs nearest to the worst value is coloured, run `worst` is drawn thick. `ticks` are
    words by their place in the unit interval, for every input.
    """
    ax = current_axes(ax)
    order = np.argsort(np.abs(values - values[worst]))
    count = max(1, len(values) // 10)
    for i in order[count:]:
        ax.plot(unit_points[i], color=PALE, lw=0.5, alpha=0.7, zorder=1)
    for i in order[:count]:
        ax.plot(unit_points[i], color=ORANGE, lw=1, zorder=2)
    ax.plot(unit_points[worst], "o-", color=VERMILLION, lw=2, zorder=3)
    ax.plot([], [], color=PALE, label="all runs")
    ax.plot([], [], color=ORANGE, label=f"the {count} nearest to the worst")
    ax.plot([], [], "o-", color=VERMILLION, label="the worst case")
    for j, words in enumerate(ticks):
        ax.vlines(j, 0.0, 1.0, color=GREY, lw=0.8, zorder=1)
        for place, word in words.items():
            ax.plot(j, place, "_", color=GREY, ms=7, zorder=1)
            ax.annotate(
                word, (j, place), xytext=(5, 0), textcoords="offset points", va="center", fontsize=7,
                zorder=5, bbox={"boxstyle": "square,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8},
            )  # fmt: skip
    ax.set_xticks(range(len(names)), names)
    ax.set_xlim(-0.2, len(names) - 1 + (0.5 if ticks else 0.2))
    ax.set(ylim=(-0.06, 1.06), ylabel="lower (0) to upper (1) bound")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


@any_label
def plot_baselines(
    found: Mapping[str, float], *, label: str = "response", unit: str = "1", ax: "Axes | None" = None
) -> "Axes":
    """The worst that each way of searching found at the same number of runs, one dot per way."""
    ax = current_axes(ax)
    names = list(found)
    for row, name in enumerate(names):
        ours = row == 0
        ax.plot(
            found[name], row, "o" if ours else "D", color=VERMILLION if ours else GREY, ms=7 if ours else 5
        )
        ax.annotate(
            f"{found[name]:.5g}", (found[name], row), xytext=(0, 6), textcoords="offset points", ha="center",
            fontsize=8,
        )  # fmt: skip
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.7)
    ax.margins(x=0.12)
    ax.set(xlabel=axis_label(f"worst {label} found", unit))
    return ax

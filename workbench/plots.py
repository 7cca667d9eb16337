"""Figures of a campaign: data in, axes out, labelled with units.

Every function draws on `ax` (the current axes without one) and returns it; none of them shows, saves or sizes
a figure. `plt.style.use("workbench.style")` gives the look of the report. The data are the mappings of the
campaign's documents (`screening.json`, `worst_case.json`), so `plot_waterfall(json.load(f)["path"])` works.

Second cues beside colour: accepted and rejected steps differ by hatching, proposals by marker, the confirming
run by a ring.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.unit_text import raised

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "axis_label",
    "beats",
    "plot_baselines",
    "plot_failures",
    "plot_likelihood_path",
    "plot_main_effect",
    "plot_parallel",
    "plot_percentiles",
    "plot_predicted",
    "plot_profile",
    "plot_quantiles",
    "plot_response",
    "plot_search",
    "plot_standardised",
    "plot_surprise",
    "plot_theta",
    "plot_waterfall",
]

BLUE, VERMILLION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
GREY, PALE = "#8a939d", "#c9d0d8"
NORMAL_95 = 1.959963984540054


def axis_label(name: str, unit: str = "1") -> str:
    """A name with its unit in brackets; nothing for the dimensionless unit.

    >>> axis_label("Tu", "m^2/yr"), axis_label("x1")
    ('Tu [m²/yr]', 'x1')
    """
    return name if unit in ("", "1") else f"{name} [{raised(unit)}]"


def _axes(ax: "Axes | None") -> "Axes":
    if ax is not None:
        return ax
    from matplotlib import pyplot as plt

    return plt.gca()


def _whole_numbers() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(integer=True)


# ---- runs and design ------------------------------------------------------------------------------------


def plot_response(
    values: Sequence[float | None],
    *,
    stages: Sequence[str],
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Every run's response in the order run, by stage; a failed run is a cross on the axis."""
    ax = _axes(ax)
    number = np.arange(1, len(values) + 1)
    y = np.array([np.nan if v is None else v for v in values], dtype=float)
    for stage, marker in zip(dict.fromkeys(stages), "osD^vP*X<>" * len(stages), strict=False):
        of_stage = np.array([s == stage for s in stages]) & np.isfinite(y)
        if of_stage.any():
            ax.plot(number[of_stage], y[of_stage], marker, mfc="none", label=stage)
    failed = ~np.isfinite(y)
    if failed.any():
        ax.plot(
            number[failed], np.zeros(failed.sum()), "x", color="#1b1f24", clip_on=False, label="failed",
            transform=ax.get_xaxis_transform(),
        )  # fmt: skip
    ax.set(xlabel="run", ylabel=axis_label(label, unit))
    ax.legend(loc="best")
    return ax


def plot_failures(
    parameters: Sequence[str], *, passed: np.ndarray, failed: np.ndarray, ax: "Axes | None" = None
) -> "Axes":
    """Where runs failed: per parameter the unit coordinates of good runs (n, d) and failed runs (m, d)."""
    ax = _axes(ax)
    rows = np.arange(len(parameters))
    for j in rows:
        ax.plot(passed[:, j], np.full(len(passed), j + 0.12), "|", color=PALE, ms=7)
        ax.plot(failed[:, j], np.full(len(failed), j - 0.12), "x", color=VERMILLION, ms=5)
    ax.plot([], [], "|", color=PALE, ms=7, label="gave a value")
    ax.plot([], [], "x", color=VERMILLION, label="failed")
    ax.set(xlim=(-0.02, 1.02), xlabel="position between lower (0) and upper (1) bound")
    ax.set_yticks(rows, parameters)
    ax.set_ylim(len(parameters) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return ax


def beats(quality: Mapping[str, Any]) -> float | None:
    """Per cent of random Latin hypercubes that a design is better than, from {percentile, better}.

    `percentile` is the share of them with a smaller value, as `doe.Quality.to_dict` writes it.

    >>> beats({"percentile": 93.0, "better": "high"}), beats({"percentile": 31.0, "better": "low"})
    (93.0, 69.0)
    """
    below = quality.get("percentile")
    if below is None:
        return None
    return float(below) if quality["better"] == "high" else 100.0 - float(below)


def plot_percentiles(quality: Mapping[str, Mapping[str, Any]], *, ax: "Axes | None" = None) -> "Axes":
    """Bars of the share of random Latin hypercubes that a design is better than, per quality."""
    ax = _axes(ax)
    named = {name: q for name, q in quality.items() if beats(q) is not None}
    rows = range(len(named))
    shares = [beats(q) or 0.0 for q in named.values()]
    ax.barh(rows, shares, height=0.6, color=[BLUE if s >= 50 else ORANGE for s in shares])
    ax.axvline(50, color=GREY, lw=1, ls="--")
    for row, share in zip(rows, shares, strict=True):
        inside = share > 85
        ax.text(
            share + (-1.5 if inside else 1.5), row, f"{share:.0f} %", va="center",
            ha="right" if inside else "left", color="white" if inside else "#1b1f24", fontsize=8,
        )  # fmt: skip
    ax.set(xlim=(0, 100), xlabel="better than this share of random Latin hypercubes [%]")
    ax.set_yticks(rows, [name.replace("_", " ") for name in named])
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    return ax


# ---- screening --------------------------------------------------------------------------------------------


def plot_waterfall(
    path: Sequence[Mapping[str, Any]], *, threshold: float | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Gain of the restricted log-likelihood of every release; a rejected step is hatched and empty.

    The bars hang on the likelihood itself, so a step starts where the one before it ended. `threshold`, in
    units of the likelihood, is drawn above every step's start as a tick.
    """
    ax = _axes(ax)
    level = None
    for k, step in enumerate(path):
        height = float(step.get("gain") or 0.0)
        top = float(step["log_likelihood"])
        base = top - height
        accepted = bool(step.get("accepted", True))
        ax.bar(
            k, height, bottom=base, width=0.62, color=BLUE if accepted else "white", zorder=2,
            edgecolor=BLUE if accepted else VERMILLION, hatch=None if accepted else "////",
        )  # fmt: skip
        if not height:
            ax.plot([k - 0.31, k + 0.31], [top, top], color=BLUE if accepted else VERMILLION, lw=2, zorder=3)
        if level is not None:
            ax.plot([k - 0.69, k + 0.31], [base, base], color=GREY, lw=0.8, ls=":", zorder=1)
        if threshold is not None and height:
            ax.plot([k - 0.4, k + 0.4], [base + threshold] * 2, color="#1b1f24", lw=1.1, zorder=4)
        if height:
            ax.annotate(
                f"{height:+.2f}", (k, max(top, base, base + (threshold or 0.0))), xytext=(0, 3),
                textcoords="offset points", ha="center", fontsize=8, zorder=5,
            )  # fmt: skip
        level = top
    ax.set_xticks(range(len(path)), [_step_label(step) for step in path])
    ax.set(xlabel="released at this step", ylabel="restricted log-likelihood l")
    ax.margins(y=0.12)
    ax.grid(axis="x", visible=False)
    if threshold is not None:
        ax.plot([], [], color="#1b1f24", lw=1.1, label=f"gain needed: {threshold:.3g}")
        ax.legend(loc="upper left")
    return ax


def _step_label(step: Mapping[str, Any]) -> str:
    added = step.get("added") or []
    if not added:
        return "common θ"
    text = added if isinstance(added, str) else "\n".join(added)
    return text if step.get("accepted", True) else f"({text})"


def plot_likelihood_path(
    path: Sequence[Mapping[str, Any]], *, threshold: float | None = None, ax: "Axes | None" = None
) -> "Axes":
    """The restricted log-likelihood over the number of inputs with a range of their own, kept step marked."""
    ax = _axes(ax)
    counts = [len(step["selected"]) for step in path]
    values = [float(step["log_likelihood"]) for step in path]
    ax.plot(counts, values, "-", color=GREY, lw=1)
    for kept, marker in ((True, "o"), (False, "X")):
        some = [k for k, step in enumerate(path) if bool(step.get("accepted", True)) == kept]
        if some:
            ax.plot(
                [counts[k] for k in some], [values[k] for k in some], marker,
                color=BLUE if kept else VERMILLION, label="accepted" if kept else "rejected",
            )  # fmt: skip
    if threshold is not None:
        ax.set_title(f"gain needed per input: {threshold:.3g}")
    ax.set(xlabel="inputs with a θ of their own", ylabel="restricted log-likelihood l")
    ax.legend(loc="lower right")
    return ax


def plot_theta(
    theta: Mapping[str, float],
    *,
    selected: Sequence[str],
    at_bound: Sequence[str] = (),
    ax: "Axes | None" = None,
) -> "Axes":
    """Correlation parameters on a log axis, selected inputs filled; a value at the optimiser's bound is `<`.

    A dot chart, not bars: a logarithmic axis has no zero for a bar to stand on.
    """
    ax = _axes(ax)
    names = sorted(theta, key=lambda name: -theta[name])
    values = np.array([theta[name] for name in names])
    positive = values[values > 0]
    floor = float(positive.min()) / 10 if len(positive) else 1e-6
    chosen = set(selected)
    for row, (name, value) in enumerate(zip(names, values, strict=True)):
        colour = BLUE if name in chosen else GREY
        bounded = name in at_bound or value <= 0
        ax.plot([floor, max(value, floor)], [row, row], color=PALE, lw=1)
        ax.plot(
            max(value, floor), row, "<" if bounded else "o", color=colour,
            mfc=colour if name in chosen else "white", ms=6,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set(xlabel="θ in the unit cube: larger is more active")
    ax.plot([], [], "o", color=BLUE, label="selected")
    ax.plot([], [], "o", color=GREY, mfc="white", label="not selected")
    ax.legend(loc="lower right")
    ax.grid(axis="y", visible=False)
    return ax


def plot_main_effect(
    effect: Mapping[str, Sequence[float]],
    *,
    name: str,
    unit: str = "1",
    response: str = "response",
    response_unit: str = "1",
    limits: tuple[float, float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Mean response over one input, the others averaged out, with the 95 % band of that average."""
    ax = _axes(ax)
    x = effect["x"]
    if all(isinstance(v, (int, float)) for v in x):
        ax.fill_between(x, effect["lower"], effect["upper"], color=BLUE, alpha=0.18, lw=0, label="95 % band")
        ax.plot(x, effect["mean"], color=BLUE)
    else:
        place, mean = np.arange(len(x)), np.asarray(effect["mean"])
        bars = [mean - np.asarray(effect["lower"]), np.asarray(effect["upper"]) - mean]
        ax.errorbar(place, mean, yerr=bars, fmt="o", color=BLUE, capsize=3)
        ax.set_xticks(place, [str(v) for v in x])
    ax.set(xlabel=axis_label(name, unit), ylabel=axis_label(response, response_unit))
    if limits is not None:
        ax.set_ylim(limits)
    return ax


# ---- fit quality ------------------------------------------------------------------------------------------


def plot_predicted(
    leave_one_out: Mapping[str, Any], *, label: str = "response", unit: str = "1", ax: "Axes | None" = None
) -> "Axes":
    """Every run against the prediction of a Kriging that did not see it, with its 95 % bar."""
    ax = _axes(ax)
    observed = np.asarray(leave_one_out["observed"], dtype=float)
    predicted = np.asarray(leave_one_out["predicted"], dtype=float)
    bar = NORMAL_95 * np.asarray(leave_one_out["std"], dtype=float)
    missed = np.abs(observed - predicted) > bar
    ends = [float(min(observed.min(), predicted.min())), float(max(observed.max(), predicted.max()))]
    ax.plot(ends, ends, color=GREY, lw=1, ls="--", zorder=1)
    for outside, colour, marker in ((False, BLUE, "o"), (True, VERMILLION, "s")):
        some = missed == outside
        if some.any():
            ax.errorbar(
                predicted[some], observed[some], xerr=bar[some], fmt=marker, ms=4, color=colour,
                elinewidth=0.8, alpha=0.9, label="outside its bar" if outside else "inside its bar",
            )  # fmt: skip
    ax.set(xlabel=axis_label("predicted without the run", unit), ylabel=axis_label(f"true {label}", unit))
    ax.legend(loc="upper left")
    return ax


def plot_standardised(leave_one_out: Mapping[str, Any], *, ax: "Axes | None" = None) -> "Axes":
    """Leave-one-out errors in standard deviations over the prediction: no pattern, few beyond 2."""
    ax = _axes(ax)
    predicted = np.asarray(leave_one_out["predicted"], dtype=float)
    z = np.asarray(leave_one_out["standardised"], dtype=float)
    ax.axhspan(-NORMAL_95, NORMAL_95, color=BLUE, alpha=0.08, lw=0)
    ax.axhline(0, color=GREY, lw=1)
    out = np.abs(z) > NORMAL_95
    ax.plot(predicted[~out], z[~out], "o", color=BLUE, ms=4)
    ax.plot(predicted[out], z[out], "s", color=VERMILLION, ms=4)
    ax.set(xlabel="predicted without the run", ylabel="error in standard deviations")
    return ax


def plot_quantiles(leave_one_out: Mapping[str, Any], *, ax: "Axes | None" = None) -> "Axes":
    """Ordered standardised errors against those of a normal law: on the line, the stated bars are right."""
    from statistics import NormalDist

    ax = _axes(ax)
    z = np.sort(np.asarray(leave_one_out["standardised"], dtype=float))
    law = NormalDist()
    expected = [law.inv_cdf((k + 0.5) / len(z)) for k in range(len(z))]
    ends = [expected[0], expected[-1]]
    ax.plot(ends, ends, color=GREY, lw=1, ls="--")
    ax.plot(expected, z, "o", color=BLUE, ms=4)
    ax.set(xlabel="expected of a normal law", ylabel="error in standard deviations")
    return ax


# ---- worst case -------------------------------------------------------------------------------------------

MARKERS = {
    "given": ("o", PALE),
    "start": ("o", GREY),
    "predicted": ("D", BLUE),
    "ei": ("s", GREEN),
    "corner": ("^", PURPLE),
    "trust": ("v", ORANGE),
}
OTHER_MARKERS = "Pp*hX<>"


def plot_search(
    history: Sequence[Mapping[str, Any]],
    *,
    run_key: str | None = None,
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """True values of the search in the order run, by what proposed them, with the worst so far as a stair."""
    ax = _axes(ax)
    number = np.arange(1, len(history) + 1)
    best = np.array([np.nan if h.get("best") is None else h["best"] for h in history], dtype=float)
    ax.step(number, best, where="post", color="#1b1f24", lw=1.1, label="worst so far", zorder=1)
    kinds = list(dict.fromkeys(str(h.get("proposal", "run")) for h in history))
    others = iter(OTHER_MARKERS * len(kinds))
    for kind in kinds:
        marker, colour = MARKERS.get(kind) or (next(others), VERMILLION)
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
        ax.plot(*ringed[0], "o", ms=12, mfc="none", mec=VERMILLION, mew=1.8, label="confirming run", zorder=3)
    ax.xaxis.set_major_locator(_whole_numbers())
    ax.set(xlabel="run", ylabel=axis_label(label, unit))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def plot_surprise(
    history: Sequence[Mapping[str, Any]],
    *,
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """What the Kriging expected before each run, with its 95 % bar, and what the run gave."""
    ax = _axes(ax)
    known = [h for h in history if h.get("predicted") is not None and h.get("value") is not None]
    number = [h.get("iteration", k) for k, h in enumerate(known)]
    bar = [NORMAL_95 * float(h.get("predicted_std") or 0.0) for h in known]
    ax.errorbar(
        number, [h["predicted"] for h in known], yerr=bar, fmt="_", color=GREY, capsize=2, elinewidth=0.9,
        label="predicted, 95 % bar",
    )  # fmt: skip
    ax.plot(number, [h["value"] for h in known], "o", color=VERMILLION, ms=4, label="true run")
    ax.xaxis.set_major_locator(_whole_numbers())
    ax.set(xlabel="run", ylabel=axis_label(label, unit))
    ax.legend(loc="best")
    return ax


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
    ax = _axes(ax)
    x = list(profile["x"])
    words = not all(isinstance(v, (int, float)) for v in [*x, worst])
    place: dict[Any, float] = {v: float(k) for k, v in enumerate(x)} if words else {}

    def at(v: Any) -> float:
        return place.get(v, np.nan) if words else float(v)

    if runs:
        ax.plot([at(v) for v, _ in runs], [y for _, y in runs], "o", color=PALE, ms=3, zorder=1)
    line = [at(v) for v in x]
    ax.fill_between(line, profile["lower"], profile["upper"], color=BLUE, alpha=0.18, lw=0)
    ax.plot(line, profile["mean"], "o-" if words else "-", color=BLUE)
    ax.plot(
        at(worst), value, "o", ms=9, mew=1.8, mec=VERMILLION, mfc=VERMILLION if confirmed else "white",
        zorder=4, clip_on=False,
    )  # fmt: skip
    if words:
        ax.set_xticks(range(len(x)), [str(v) for v in x])
    ax.set(xlabel=axis_label(name, unit), ylabel=axis_label(response, response_unit))
    return ax


def plot_parallel(
    unit_points: np.ndarray, *, values: np.ndarray, names: Sequence[str], worst: int, ax: "Axes | None" = None
) -> "Axes":
    """Runs (n, d) in the unit cube as lines over the inputs; the worst of the `values` (n,) in front.

    The tenth of the runs nearest to the worst value is coloured, run `worst` is drawn thick.
    """
    ax = _axes(ax)
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
    ax.set_xticks(range(len(names)), names)
    ax.set(ylim=(-0.03, 1.03), ylabel="lower (0) to upper (1) bound")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


def plot_baselines(
    found: Mapping[str, float], *, label: str = "response", unit: str = "1", ax: "Axes | None" = None
) -> "Axes":
    """The worst that each way of searching found at the same number of runs, one dot per way."""
    ax = _axes(ax)
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

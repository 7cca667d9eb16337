"""Figures of the worst-case section: how it was found, what the response does around it, what plain ways
found."""

from collections.abc import Mapping
from typing import Any

from workbench.figures.parts import NORMAL_95
from workbench.figures.worst_case import (
    plot_baselines,
    plot_profile,
    plot_search,
    plot_surprise,
)
from workbench.report.lines.statements import failure_of
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Panel,
    Table,
    names_of,
    number,
)
from workbench.report.page.folder import CampaignFolder

__all__ = [
    "baseline_figures",
    "profile_figure",
    "search_figure",
    "selected_names",
    "surprise_figure",
]

MOST_PROFILES = 8


def selected_names(folder: CampaignFolder) -> list[str]:
    """Names of the parameters that the screening selected, none without a screening."""
    screening = folder["screening"]
    return list(screening["selected"]) if screening is not None else []


def search_figure(
    folder: CampaignFolder, worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> Figure:
    """Every run in order, marked by what proposed it, and the worst so far."""
    key = worst.get("run_key") if worst["confirmed"] else None
    names = list(folder.parameters or worst["parameters"])
    searched = [h for h in history if h.get("iteration")]
    found = next((k for k, h in enumerate(searched, start=1) if h.get("run_key") == key), None)
    read_off = (
        "The stair is the worst true value so far; a long flat end says that the search found nothing more."
    )
    if worst.get("mean") is not None:
        read_off = (
            "The stair is the worst of the means that the Kriging of all runs holds at the runs so far."
        )
    if not searched:
        read_off = (
            "The stair is the worst value so far of the runs given, in their order; nothing was searched."
        )
    ringed = "confirming run" if worst.get("mean") is None else "first run of the mean"
    if failure_of(worst) is not None:
        ringed = "worst that gave a value"
    if found is not None:
        read_off += f" The {ringed} (ring) was run {found} of {len(searched)} of the search."
    return Figure(
        id="search",
        title="How it was found" if searched else "The runs given",
        alt=f"{response} of {len(history)} runs in order with the worst so far, which ends at "
        f"{_end(history)}.",
        read_off=read_off,
        panels=(
            Panel(
                draw=lambda ax: plot_search(
                    history, run_key=key, run_label=ringed, label=response, unit=unit, ax=ax
                ),
                width=7.0,
                height=3.0,
            ),
        ),
        table=Table(
            id="search",
            title="All runs of the search" if searched else "All runs given",
            columns=(
                Column(name="run of the search"),
                Column(name="key"),
                Column(name="proposed by"),
                Column(name="status"),
                Column(name=response, unit=unit),
                Column(name="worst so far", unit=unit),
                Column(name="predicted before", unit=unit),
                Column(name="standard deviation", unit=unit),
                *(Column(name=name, unit=folder.unit_of(name)) for name in names),
            ),
            rows=tuple(
                (
                    h.get("iteration") if searched else None,
                    h.get("run_key"),
                    h.get("proposal"),
                    h.get("status", "ok"),
                    h.get("value"),
                    h.get("best"),
                    h.get("predicted"),
                    h.get("predicted_std"),
                    *(h.get("parameters", {}).get(name) for name in names),
                )
                for h in history
            ),
            marked=frozenset(k for k, h in enumerate(history) if key and h.get("run_key") == key),
        ),
    )


def _end(history: list[dict[str, Any]]) -> str:
    """Where the stair of the worst so far ends: under noise not at the mean that is stated."""
    best = history[-1].get("best")
    return "no value" if best is None else number(best)


def profile_figure(
    folder: CampaignFolder, worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> Figure:
    """The response along each selected parameter through the worst case, with its band."""
    profile = worst["profile"]
    wanted = [name for name in selected_names(folder) if name in profile] or sorted(
        profile, key=lambda name: min(profile[name]["mean"]) - max(profile[name]["mean"])
    )
    names = wanted[:MOST_PROFILES]
    confirmed = bool(worst["confirmed"])

    def panel(name: str) -> Panel:
        seen = [
            (h["parameters"][name], h["value"])
            for h in history
            if h.get("value") is not None and name in h.get("parameters", {})
        ]

        def draw(ax: Any) -> Any:
            return plot_profile(
                profile[name], name=name, unit=folder.unit_of(name), worst=worst["parameters"][name],
                value=worst["value"], confirmed=confirmed, runs=seen, response=response, response_unit=unit,
                ax=ax,
            )  # fmt: skip

        return Panel(draw=draw, width=3.2, height=2.6)

    mark = "red dot is the confirming run" if confirmed else "open ring is the surrogate's extreme, not run"
    if worst.get("mean") is not None:
        mark = "red dot is the mean of the repeated runs"
    if failure_of(worst) is not None:
        mark = "red dot is the worst that gave a value"
    return Figure(
        id="profile",
        title="The response around the worst case",
        alt=f"{response} along {names_of(names)}, each through the worst case of {number(worst['value'])}.",
        read_off="Line and 95 % band are the Kriging's, all other parameters at their worst values; the "
        f"{mark}, grey dots are true runs elsewhere. A steep line at a bound says that a wider range would "
        "be worse.",
        panels=tuple(panel(name) for name in names),
        table=Table(
            id="profile",
            title="The response around the worst case",
            columns=(
                Column(name="parameter"),
                Column(name="at"),
                Column(name="unit"),
                Column(name=f"predicted {response}", unit=unit),
                Column(name="lower", unit=unit),
                Column(name="upper", unit=unit),
            ),
            rows=tuple(_profile_rows(folder, profile, names)),
        ),
    )


def _profile_rows(
    folder: CampaignFolder, profile: Mapping[str, Any], names: list[str]
) -> list[tuple[Any, ...]]:
    """At most nine points of each band."""
    rows: list[tuple[Any, ...]] = []
    for name in names:
        band = profile[name]
        n = len(band["x"])
        for k in dict.fromkeys(round(i * (n - 1) / max(min(n - 1, 8), 1)) for i in range(min(n - 1, 8) + 1)):
            rows.append(
                (
                    name,
                    band["x"][k],
                    folder.unit_of(name),
                    band["mean"][k],
                    band["lower"][k],
                    band["upper"][k],
                )
            )
    return rows


def surprise_figure(
    worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> Figure:
    """What was predicted of each run before it was made, and what it gave."""
    known = [h for h in history if h.get("predicted") is not None and h.get("value") is not None]
    inside = sum(
        abs(h["value"] - h["predicted"]) <= NORMAL_95 * float(h.get("predicted_std") or 0.0) for h in known
    )
    return Figure(
        id="surprise",
        title="Prediction and truth at each proposed run",
        alt=f"Predicted and true {response} of {len(known)} proposed runs; {inside} inside the 95 % bar.",
        read_off=f"{inside} of {len(known)} true runs lie in the bar that was predicted before they were "
        "made. A search goes where the Kriging is unsure, so some surprise early on is right; late surprise "
        "is not. Bars may go on beyond the frame.",
        panels=(
            Panel(
                draw=lambda ax: plot_surprise(history, label=response, unit=unit, ax=ax),
                width=6.4,
                height=2.9,
            ),
        ),
        table=Table(
            id="surprise",
            title="Prediction and truth at each proposed run",
            columns=(
                Column(name="run of the search"),
                Column(name="predicted", unit=unit),
                Column(name="standard deviation", unit=unit),
                Column(name="true", unit=unit),
            ),
            rows=tuple(
                (h.get("iteration"), h["predicted"], h.get("predicted_std"), h["value"]) for h in known
            ),
        ),
    )


def baseline_figures(
    folder: CampaignFolder, worst: Mapping[str, Any], response: str, unit: str
) -> list[Block]:
    """The worst value found beside what plain ways found, by true runs; none where there are no such runs."""
    given: Mapping[str, Mapping[str, Any]] = worst.get("baselines") or {}
    if not given:
        return []
    ways = _ways(worst, given)
    if ways.keys() <= given.keys():
        return []  # a table of runs, where nothing was searched
    found = {name: value for name, (_, value, _) in ways.items()}
    return [
        Figure(
            id="baselines",
            title="What the search bought",
            alt="Worst value found by this search and by plain ways: "
            + ", ".join(f"{name} ({runs} runs) {number(value)}" for name, (runs, value, _) in ways.items())
            + ".",
            read_off="Every dot is a true run, the worst of its way; nothing is predicted. The table has how "
            "many runs each way had. Dots level with ours say that a plain way would have done here.",
            panels=(
                Panel(
                    draw=lambda ax: plot_baselines(found, label=response, unit=unit, ax=ax),
                    width=5.6,
                    height=0.9 + 0.4 * len(found),
                ),
            ),
            table=Table(
                id="baselines",
                title="What the search bought",
                columns=(
                    Column(name="way of searching"),
                    Column(name="runs"),
                    Column(name=f"worst {response}", unit=unit),
                    Column(name="run"),
                ),
                rows=tuple(
                    (name, runs, value, folder.run_name(key)) for name, (runs, value, key) in ways.items()
                ),
            ),
        )
    ]


def _ways(
    worst: Mapping[str, Any], given: Mapping[str, Mapping[str, Any]]
) -> dict[str, tuple[int, float, str]]:
    """Number of runs, worst value and its key: of this search, of the attack where it went beyond, of plain
    ways.

    The worst case may be the find of the attack, or a run that was known otherwise: neither is the search's.
    """
    sign = 1.0 if worst["sense"] == "max" else -1.0
    made: dict[str, list[Mapping[str, Any]]] = {"this search": [], "the attack on it": []}
    for run in worst.get("history") or []:
        if run["iteration"] > 0:
            is_attack = str(run["proposal"]).startswith("attack")
            made["the attack on it" if is_attack else "this search"].append(run)
    ways: dict[str, tuple[int, float, str]] = {}
    for name, runs in made.items():
        best = max(
            (run for run in runs if run["value"] is not None),
            key=lambda run: sign * run["value"],
            default=None,
        )
        if best is not None and all(sign * best["value"] > sign * value for _, value, _ in ways.values()):
            ways[name] = (len(runs), float(best["value"]), str(best["run_key"]))
    return ways | {name: (int(b["runs"]), float(b["value"]), str(b["run_key"])) for name, b in given.items()}

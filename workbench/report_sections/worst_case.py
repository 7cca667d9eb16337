"""The worst case: where it lies, which run confirms it, how it was found, and how much worse it could be."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.report_sections.blocks import (
    Block,
    Column,
    Figure,
    Note,
    Panel,
    Section,
    Table,
    names_of,
    number,
    percent,
    quantity,
)
from workbench.report_sections.folder import CampaignFolder
from workbench.worst_case_plots import plot_baselines, plot_parallel, plot_profile, plot_search, plot_surprise

__all__ = ["gap_sentence", "worst_case_section"]

MOST_PROFILES = 8
MOST_RANKED = 10
FEWEST_FOR_PARALLEL = 10


def gap_sentence(worst: Mapping[str, Any]) -> str:
    """What is known about how much worse it could be."""
    gap = worst.get("gap")
    if not gap:
        return "No bound on how much worse it could be was computed."
    width = quantity(gap["width"], str(worst.get("unit") or "1"), 4)
    kind = str(gap.get("kind", "model-based"))
    if kind == "enumerated":
        return "Every point of the space was run: nothing worse exists."
    if kind.lower() == "lipschitz":
        return f"With the given Lipschitz constant it is certain that at most {width} more is possible."
    if kind == "enclosure":
        end = "" if gap.get("closed") else "; more calls of it would narrow this"
        return f"By the given interval enclosure it is certain that at most {width} more is possible{end}."
    stated = f" with {percent(gap['coverage'])} confidence" if gap.get("coverage") else ""
    return f"By the Kriging{stated} it could be at most {width} worse ({kind}, not a proof)."


def worst_case_section(folder: CampaignFolder) -> Section | None:
    """None without `worst_case.json`."""
    worst = folder["worst_case"]
    if worst is None:
        return None
    response, unit = str(worst["response"]), str(worst.get("unit") or "1")
    side = "largest" if worst["sense"] == "max" else "smallest"
    confirmed = bool(worst["confirmed"])
    sentences = [
        f"The {side} {response} is {quantity(worst['value'], unit)}, {worst['label']}"
        + (f": {folder.run_name(worst.get('run_key'))}." if confirmed else ".")
    ]
    if confirmed:
        sentences.append(gap_sentence(worst))
    if worst.get("status"):
        sentences.append(f"Why the search ended: {str(worst['status']).rstrip('.')}.")
    failures = {k: n for k, n in (worst.get("failures") or {}).items() if n}
    if failures:
        sentences.append(
            "Runs without a value: " + ", ".join(f"{n} {k}" for k, n in sorted(failures.items())) + "."
        )
    blocks: list[Block] = []
    if not confirmed:
        blocks.append(
            Note(
                text="Unconfirmed: no run was made at this point. It is the extreme of the surrogate alone; "
                "run the "
                "model there before relying on it.",
                level="fair",
            )
        )
    history = list(worst.get("history") or [])
    blocks.append(_where(folder, worst, unit))
    if history:
        blocks.append(_ranked(folder, worst, history, response, unit))
        blocks.append(_search(worst, history, response, unit))
    if worst.get("profile"):
        blocks.append(_profile(folder, worst, history, response, unit))
    if any(h.get("predicted") is not None and h.get("value") is not None for h in history):
        blocks.append(_surprise(worst, history, response, unit))
    parallel = _parallel(folder, worst, response)
    blocks += [] if parallel is None else [parallel]
    blocks += _baselines(worst, response, unit)
    blocks += _audit(folder, worst)
    return Section(
        id="worst-case",
        title="The worst case",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={
            key: worst.get(key)
            for key in (
                "response", "unit", "sense", "value", "parameters", "confirmed", "label", "run_key",
                "predicted", "predicted_std", "evaluations", "budget", "failures", "gap", "baselines",
            )
        },
    )  # fmt: skip


def _selected(folder: CampaignFolder) -> list[str]:
    screening = folder["screening"]
    return list(screening["selected"]) if screening is not None else []


def _where(folder: CampaignFolder, worst: Mapping[str, Any], unit: str) -> Table:
    selected = _selected(folder)
    rows = []
    for name in folder.parameters or worst["parameters"]:
        value = worst["parameters"][name]
        p = folder.parameters.get(name, {})
        rows.append(
            (
                name,
                value,
                folder.unit_of(name),
                p.get("lower"),
                p.get("upper"),
                _place(value, p),
                name in selected,
            )
        )
    rows.sort(key=lambda row: (not row[-1], selected.index(row[0]) if row[-1] else 0))
    return Table(
        id="worst-case",
        title="Where the worst case lies",
        columns=(
            Column(name="parameter"),
            Column(name="worst value"),
            Column(name="unit"),
            Column(name="lower"),
            Column(name="upper"),
            Column(name="place in its range"),
            Column(name="selected by screening"),
        ),
        rows=tuple(rows),
    )


def _place(value: Any, p: Mapping[str, Any]) -> str:
    low, high = p.get("lower"), p.get("upper")
    if not isinstance(value, (int, float)) or low is None or high is None or high <= low:
        return "–"
    share = (value - low) / (high - low)
    return "lower bound" if share <= 1e-9 else "upper bound" if share >= 1 - 1e-9 else percent(share)


def _ranked(
    folder: CampaignFolder, worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> Table:
    known = [h for h in history if h.get("value") is not None]
    sign = 1.0 if worst["sense"] == "max" else -1.0
    ranked = sorted(known, key=lambda h: -sign * h["value"])[:MOST_RANKED]
    names = (_selected(folder) or list(worst["parameters"]))[:MOST_PROFILES]
    key = worst.get("run_key") if worst["confirmed"] else None
    return Table(
        id="worst-runs",
        title=f"The {len(ranked)} worst true runs",
        columns=(
            Column(name="rank"),
            Column(name="run"),
            Column(name=response, unit=unit),
            Column(name="predicted before", unit=unit),
            Column(name="standard deviation", unit=unit),
            Column(name="proposed by"),
            *(Column(name=name, unit=folder.unit_of(name)) for name in names),
            Column(name="note"),
        ),
        rows=tuple(
            (
                rank,
                folder.run_name(h.get("run_key")),
                h["value"],
                h.get("predicted"),
                h.get("predicted_std"),
                h.get("proposal"),
                *(h.get("parameters", {}).get(name) for name in names),
                "confirms the worst case" if key and h.get("run_key") == key else "",
            )
            for rank, h in enumerate(ranked, start=1)
        ),
        marked=frozenset(k for k, h in enumerate(ranked) if key and h.get("run_key") == key),
    )


def _search(worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str) -> Figure:
    key = worst.get("run_key") if worst["confirmed"] else None
    searched = [h for h in history if h.get("iteration")]
    found = next((k for k, h in enumerate(searched, start=1) if h.get("run_key") == key), None)
    read_off = (
        "The stair is the worst true value so far; a long flat end says that the search found nothing more."
    )
    if found is not None:
        read_off += f" The confirming run (ring) was run {found} of {len(searched)} of the search."
    return Figure(
        id="search",
        title="How it was found",
        alt=f"{response} of {len(history)} runs in order with the worst so far, which ends at "
        f"{number(worst['value'])}.",
        read_off=read_off,
        panels=(
            Panel(
                draw=lambda ax: plot_search(history, run_key=key, label=response, unit=unit, ax=ax),
                width=7.0,
                height=3.0,
            ),
        ),
        table=Table(
            id="search",
            title="All runs of the search",
            columns=(
                Column(name="run of the search"),
                Column(name="key"),
                Column(name="proposed by"),
                Column(name="status"),
                Column(name=response, unit=unit),
                Column(name="worst so far", unit=unit),
                Column(name="predicted before", unit=unit),
                Column(name="standard deviation", unit=unit),
            ),
            rows=tuple(
                (
                    h.get("iteration"),
                    h.get("run_key"),
                    h.get("proposal"),
                    h.get("status", "ok"),
                    h.get("value"),
                    h.get("best"),
                    h.get("predicted"),
                    h.get("predicted_std"),
                )
                for h in history
            ),
            marked=frozenset(k for k, h in enumerate(history) if key and h.get("run_key") == key),
        ),
    )


def _profile(
    folder: CampaignFolder, worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> Figure:
    profile = worst["profile"]
    wanted = [name for name in _selected(folder) if name in profile] or sorted(
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

    rows = []
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
    mark = "red dot is the confirming run" if confirmed else "open ring is the surrogate's extreme, not run"
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
            rows=tuple(rows),
        ),
    )


def _surprise(worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str) -> Figure:
    known = [h for h in history if h.get("predicted") is not None and h.get("value") is not None]
    inside = sum(
        abs(h["value"] - h["predicted"]) <= 1.96 * float(h.get("predicted_std") or 0.0) for h in known
    )
    return Figure(
        id="surprise",
        title="Prediction and truth at each proposed run",
        alt=f"Predicted and true {response} of {len(known)} proposed runs; {inside} inside the 95 % bar.",
        read_off=f"{inside} of {len(known)} true runs lie in the bar that was predicted before they were "
        "made. A search "
        "goes where the Kriging is unsure, so some surprise early on is right; late surprise is not.",
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


def _parallel(folder: CampaignFolder, worst: Mapping[str, Any], response: str) -> Figure | None:
    """All true runs over the parameters that matter; None when there are too few."""
    names = [
        name
        for name in (_selected(folder) or list(worst["parameters"]))
        if folder.parameters.get(name, {}).get("lower") is not None
    ][:MOST_RANKED]
    runs = [
        run
        for run in folder.runs
        if run.status == "ok" and isinstance(run.outputs.get(response), (int, float))
    ]
    keys = [run.key for run in runs]
    if len(runs) < FEWEST_FOR_PARALLEL or len(names) < 2 or worst.get("run_key") not in keys:
        return None
    p = folder.parameters
    unit_points = np.array(
        [
            [(float(run.inputs[n]) - p[n]["lower"]) / ((p[n]["upper"] - p[n]["lower"]) or 1.0) for n in names]
            for run in runs
        ]
    )
    values = np.array([float(run.outputs[response]) for run in runs])
    index = keys.index(str(worst["run_key"]))
    return Figure(
        id="parallel",
        title="What the worst runs have in common",
        alt=f"{len(runs)} runs as lines over {names_of(names)}; the worst tenth in colour.",
        read_off="Where the coloured lines run together, that value makes things bad; where they fan out, "
        "the "
        "parameter does not decide.",
        panels=(
            Panel(
                draw=lambda ax: plot_parallel(unit_points, values=values, names=names, worst=index, ax=ax),
                width=6.4,
                height=3.1,
            ),
        ),
        table=Table(
            id="parallel",
            title="True runs over the parameters that matter",
            columns=(
                Column(name="run"),
                Column(name=response, unit=str(worst.get("unit") or "1")),
                *(Column(name=n, unit=folder.unit_of(n)) for n in names),
            ),
            rows=tuple((run.id, run.outputs[response], *(run.inputs[n] for n in names)) for run in runs),
            marked=frozenset({index}),
        ),
    )


def _baselines(worst: Mapping[str, Any], response: str, unit: str) -> list[Block]:
    given: Mapping[str, Mapping[str, Any]] = worst.get("baselines") or {}
    if not given:
        return []
    ours = float(worst["value"])
    found = {"this search": ours} | {name: float(b["median"]) for name, b in given.items()}
    kinds = ", ".join(sorted({str(b["kind"]) for b in given.values()}))
    return [
        Figure(
            id="baselines",
            title="What the search bought",
            alt="Worst value found by this search and by plain ways: "
            + ", ".join(f"{name} {number(v)}" for name, v in found.items())
            + ".",
            read_off=f"All ways had the same number of runs; the plain ones are medians over draws, {kinds}. "
            "Dots level with ours say that a plain search would have done here.",
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
                    Column(name="5 % of draws below", unit=unit),
                    Column(name="5 % of draws above", unit=unit),
                    Column(name="how known"),
                ),
                rows=(
                    ("this search", len(worst.get("history") or []), ours, ours, ours, worst["label"]),
                    *(
                        (
                            name,
                            b["runs"],
                            b["median"],
                            min(b["low"], b["high"]),
                            max(b["low"], b["high"]),
                            b["kind"],
                        )
                        for name, b in given.items()
                    ),
                ),
            ),
        )
    ]


def _audit(folder: CampaignFolder, worst: Mapping[str, Any]) -> list[Block]:
    audit = worst.get("audit") or {}
    blocks: list[Block] = []
    if audit.get("sentences"):
        text = "; ".join(str(s) for s in audit["sentences"])
        blocks.append(Note(text=f"Audit: {text}."))
    if audit.get("monotone"):
        share = audit.get("monotone_share") or {}
        blocks.append(
            Table(
                id="monotone",
                title=f"Does {worst['response']} rise or fall with each parameter?",
                columns=(
                    Column(name="parameter"),
                    Column(name="direction"),
                    Column(name="credible at this share of places"),
                ),
                rows=tuple(
                    (name, audit["monotone"][name], share.get(name))
                    for name in (folder.parameters or worst["parameters"])
                    if name in audit["monotone"]
                ),
            )
        )
    if audit.get("combinations"):
        keys = list(dict.fromkeys(key for c in audit["combinations"] for key in c))
        blocks.append(
            Table(
                id="combinations",
                title="Discrete combinations",
                columns=tuple(Column(name=key) for key in keys),
                rows=tuple(tuple(_flat(c.get(key)) for key in keys) for c in audit["combinations"]),
            )
        )
    return blocks


def _flat(value: Any) -> Any:
    return ", ".join(f"{k} = {number(v)}" for k, v in value.items()) if isinstance(value, dict) else value

"""The worst case: where it lies, which run confirms it, how it was found, and how much worse it could be."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from workbench.report.lines.statements import limits_text, quantile_text
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Note,
    Section,
    Table,
    names_of,
    number,
    percent,
    quantity,
    typeset,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.worst_case.figures import (
    baseline_figures,
    profile_figure,
    search_figure,
    selected_names,
    surprise_figure,
)
from workbench.report.worst_case.gap_figure import gap_figure
from workbench.report.worst_case.parallel_figure import parallel_figure

__all__ = ["further_worst_cases", "gap_sentence", "worst_case_section"]

MOST_COLUMNS = 12
MOST_RANKED = 10


def gap_sentence(worst: Mapping[str, Any]) -> str:
    """What is known about how much worse it could be."""
    gap = worst.get("gap")
    return typeset(gap["sentence"]) if gap else "No bound on how much worse it could be was computed."


def worst_case_section(folder: CampaignFolder) -> Section | None:
    """None without `worst_case.json`."""
    worst = folder["worst_case"]
    return None if worst is None else _section(folder, worst)


def further_worst_cases(folder: CampaignFolder) -> list[Section]:
    """A section for every other response of the study whose worst was searched; ids end with its name."""
    sections = []
    for other in (folder["worst_case"] or {}).get("others") or ():
        response = str(other["response"])
        section = _section(folder, other)
        sections.append(
            replace(
                section,
                id=f"{section.id}-{response}",
                title=f"The worst case of {response}",
                blocks=tuple(_renamed(block, response) for block in section.blocks),
            )
        )
    return sections


def _renamed(block: Block, response: str) -> Block:
    if isinstance(block, Note):
        return block
    if isinstance(block, Figure):
        return replace(
            block, id=f"{block.id}-{response}", table=replace(block.table, id=f"{block.table.id}-{response}")
        )
    return replace(block, id=f"{block.id}-{response}")


def _section(folder: CampaignFolder, worst: Mapping[str, Any]) -> Section:
    response, unit = str(worst["response"]), str(worst.get("unit") or "1")
    side = "largest" if worst["sense"] == "max" else "smallest"
    confirmed = bool(worst["confirmed"])
    sentences = [
        f"The {side} {response} is {quantity(worst['value'], unit)}, {worst['label']}"
        + (f": {folder.run_name(worst.get('run_key'))}." if confirmed else ".")
    ]
    if worst.get("within"):
        sentences.append(f"Only runs with {limits_text(worst['within'])} count; others are called excluded.")
    if confirmed:
        sentences.append(gap_sentence(worst))
    if worst.get("quantile"):
        said = quantile_text(worst["quantile"])
        sentences.append(f"{said[0].upper()}{said[1:]}.")
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
                "run the model there before relying on it.",
                level="fair",
            )
        )
    history = list(worst.get("history") or [])
    blocks.append(_where(folder, worst, unit))
    if worst.get("quantile"):
        blocks.append(_quantile(folder, worst["quantile"], response, unit))
    if history:
        blocks += _ranked(folder, worst, history, response, unit)
        blocks.append(search_figure(folder, worst, history, response, unit))
        closing = gap_figure(worst, history, response, unit)
        blocks += [] if closing is None else [closing]
    if worst.get("profile"):
        blocks.append(profile_figure(folder, worst, history, response, unit))
    if any(h.get("predicted") is not None and h.get("value") is not None for h in history):
        blocks.append(surprise_figure(worst, history, response, unit))
    parallel = parallel_figure(folder, worst, response)
    blocks += [] if parallel is None else [parallel]
    blocks += baseline_figures(worst, response, unit)
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
                "quantile",
            )
        },
    )  # fmt: skip


def _where(folder: CampaignFolder, worst: Mapping[str, Any], unit: str) -> Table:
    selected = selected_names(folder)
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


def _quantile(folder: CampaignFolder, quantile: Mapping[str, Any], response: str, unit: str) -> Table:
    names = list(folder.parameters or quantile["parameters"])
    return Table(
        id="quantile",
        title="The value that is exceeded with a small chance only",
        columns=(
            Column(name="chance of no worse"),
            Column(name=response, unit=unit),
            Column(name="lower", unit=unit),
            Column(name="upper", unit=unit),
            Column(name="nearest true run"),
            Column(name=f"{response} there", unit=unit),
            *(Column(name=name, unit=folder.unit_of(name)) for name in names),
        ),
        rows=(
            (
                quantile["share"],
                quantile["value"],
                quantile["lower"],
                quantile["upper"],
                folder.run_name(quantile["run_key"]),
                quantile["run_value"],
                *(quantile["parameters"][name] for name in names),
            ),
        ),
    )


def _place(value: Any, p: Mapping[str, Any]) -> str:
    low, high = p.get("lower"), p.get("upper")
    if not isinstance(value, (int, float)) or low is None or high is None or high <= low:
        return "–"
    share = (value - low) / (high - low)
    return "lower bound" if share <= 1e-9 else "upper bound" if share >= 1 - 1e-9 else percent(share)


def _ranked(
    folder: CampaignFolder, worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> list[Block]:
    known = [h for h in history if h.get("value") is not None]
    sign = 1.0 if worst["sense"] == "max" else -1.0
    ranked = sorted(known, key=lambda h: -sign * h["value"])[:MOST_RANKED]
    wanted = _telling_names(folder, worst, ranked)
    names, left_out = wanted[:MOST_COLUMNS], wanted[MOST_COLUMNS:]
    key = worst.get("run_key") if worst["confirmed"] else None
    table = Table(
        id="worst-runs",
        title=f"The {len(ranked)} worst true runs",
        columns=(
            Column(name="rank"),
            Column(name="run"),
            Column(name="note"),  # before the parameters: a wide table scrolls
            Column(name=response, unit=unit),
            Column(name="predicted before", unit=unit),
            Column(name="standard deviation", unit=unit),
            Column(name="proposed by"),
            *(Column(name=name, unit=folder.unit_of(name)) for name in names),
        ),
        rows=tuple(
            (
                rank,
                folder.run_name(h.get("run_key")),
                "confirms the worst case" if key and h.get("run_key") == key else "",
                h["value"],
                h.get("predicted"),
                h.get("predicted_std"),
                h.get("proposal"),
                *(h.get("parameters", {}).get(name) for name in names),
            )
            for rank, h in enumerate(ranked, start=1)
        ),
        marked=frozenset(k for k, h in enumerate(ranked) if key and h.get("run_key") == key),
    )
    if not left_out:
        return [table]
    text = f"These runs also differ in {names_of(left_out)}: the table of all runs of the search has them."
    return [table, Note(text=text)]


def _telling_names(
    folder: CampaignFolder, worst: Mapping[str, Any], ranked: list[dict[str, Any]]
) -> list[str]:
    """The parameters that screening selected, then others in which the ranked runs differ: levels first."""
    selected = selected_names(folder)
    differ = [
        name
        for name in folder.parameters or worst["parameters"]
        if name not in selected and len({h.get("parameters", {}).get(name) for h in ranked}) > 1
    ]
    # a run in another gear is another run; a continuous input that does not matter differs in every run
    differ.sort(key=lambda name: str(folder.parameters.get(name, {}).get("kind") or "") in ("", "continuous"))
    return [*selected, *differ] or list(worst["parameters"])


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

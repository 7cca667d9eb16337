"""The tables of the worst case: where it lies, its quantile, the worst runs, and the audit of the search."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.statements import failure_of
from workbench.report.page.blocks import Block, Column, Note, Table, names_of, number, percent
from workbench.report.page.folder import CampaignFolder
from workbench.report.worst_case.figures import selected_names

__all__ = ["audit_blocks", "place_table", "quantile_table", "ranked_runs"]

MOST_COLUMNS = 12
MOST_RANKED = 10


def place_table(folder: CampaignFolder, worst: Mapping[str, Any], unit: str) -> Table:
    """The value of each parameter in its range, the selected ones first.

    Where a failed run is the worst case, it is that which lies there, and the worst that gave a value stands
    beside it.
    """
    failure = failure_of(worst)
    selected, parameters = selected_names(folder), (failure or worst)["parameters"]
    beside = [] if failure is None else ["the worst that gave a value"]
    rows = []
    for name in folder.parameters or parameters:
        value = parameters[name]
        p = folder.parameters.get(name, {})
        rows.append(
            (
                name,
                value,
                *(worst["parameters"].get(name) for _ in beside),
                folder.unit_of(name),
                p.get("lower"),
                p.get("upper"),
                _place(value, p),
                name in selected,
            )
        )
    rows.sort(key=lambda row: (not row[-1], selected.index(row[0]) if row[-1] else 0))
    is_screened = folder["screening"] is not None
    return Table(
        id="worst-case",
        title="Where the worst case lies",
        columns=(
            Column(name="parameter"),
            Column(name="worst value" if failure is None else "the failed run"),
            *(Column(name=name) for name in beside),
            Column(name="unit"),
            Column(name="lower"),
            Column(name="upper"),
            Column(name="place in its range"),
            *([Column(name="selected by screening")] if is_screened else []),
        ),
        rows=tuple(row if is_screened else row[:-1] for row in rows),
    )


def quantile_table(folder: CampaignFolder, quantile: Mapping[str, Any], response: str, unit: str) -> Table:
    """The value that is exceeded with a small chance, its bounds and the nearest true run."""
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


def ranked_runs(
    folder: CampaignFolder, worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> list[Block]:
    """The worst true runs, and a note on parameters that have no room beside them."""
    known = [h for h in history if h.get("value") is not None]
    sign = 1.0 if worst["sense"] == "max" else -1.0
    ranked = sorted(known, key=lambda h: -sign * h["value"])[:MOST_RANKED]
    wanted = _telling_names(folder, worst, ranked)
    names, left_out = wanted[:MOST_COLUMNS], wanted[MOST_COLUMNS:]
    key = worst.get("run_key") if worst["confirmed"] else None
    role = "confirms the worst case" if worst.get("mean") is None else "first run of the mean"
    if failure_of(worst) is not None:
        role = "the worst that gave a value"
    is_searched = any(h.get("iteration") for h in history)  # of a table nothing was
    of = "true runs of the search" if is_searched else "of the runs given"
    table = Table(
        id="worst-runs",
        title=f"The {len(ranked)} worst {of}",
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
                role if key and h.get("run_key") == key else "",
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
    where = "all runs of the search" if is_searched else "all runs given"
    text = f"These runs also differ in {names_of(left_out)}: the table of {where} has them."
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


def audit_blocks(folder: CampaignFolder, worst: Mapping[str, Any]) -> list[Block]:
    """What the search says of itself: sentences, directions, discrete combinations."""
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
        unit = str(worst.get("unit", "1"))
        blocks.append(
            Table(
                id="combinations",
                title="Discrete combinations",
                columns=tuple(
                    Column(name=key, unit=unit if key in ("worst", "bound") else "1") for key in keys
                ),
                rows=tuple(tuple(_flat(c.get(key)) for key in keys) for c in audit["combinations"]),
            )
        )
    return blocks


def _flat(value: Any) -> Any:
    return ", ".join(f"{k} = {number(v)}" for k, v in value.items()) if isinstance(value, dict) else value

"""The robust loop: bounds round by round, all layouts in all cases, other problems with their prices."""

from collections.abc import Mapping
from typing import Any

from workbench.figures.loop import plot_rounds
from workbench.report.lines.robust_layout import NONE, STOOD
from workbench.report.lines.tables import format_share
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Panel,
    Section,
    Table,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.findings import case_text, was_resolved
from workbench.space.units import counted

__all__ = ["PLAIN", "robust_layout_section", "screenings_table"]

PLAIN = ("none", "uniform", "start as given", "nominal only")  # layouts that the loop is compared with


def robust_layout_section(folder: CampaignFolder) -> Section | None:
    """None without `robust_layout.json`."""
    loop = folder["robust_layout"]
    if loop is None:
        return None
    unit, rounds = str(loop.get("unit") or "1"), list(loop["rounds"])
    runs = sum(loop["runs"].values())
    failed = runs - loop["runs"].get("ok", 0)
    sizes = f"{counted(len(rounds), 'round')}, {counted(len(loop['cases']), 'case')}"
    sentences = [
        "In turn, the layout was optimised for the cases known and attacked over the whole uncertainty by "
        "true runs; what broke the bound joined the cases.",
        f"{sizes}, {counted(runs, 'different true run')} of layouts"
        f"{f', {failed} without a value' if failed else ''}.",
        str(loop["status"]),
    ]
    blocks: list[Block] = [_rounds(folder, rounds, loop, unit), _cases(folder, loop, unit)]
    if loop["variants"]:
        blocks += [_variants(loop, unit), *_prices(loop, unit)]
    if loop.get("screening") and loop["screening"]["after"] is not None:
        blocks.append(screenings_table(loop))
    return Section(
        id="robust-layout",
        title="Layout and worst case in turn",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={key: loop[key] for key in ("bound", "closed", "grade", "rounds", "variants", "runs")},
    )


def _rounds(
    folder: CampaignFolder, rounds: list[dict[str, Any]], loop: Mapping[str, Any], unit: str
) -> Figure:
    label = str(loop["response"])
    said = ", ".join(format_share(r["gap"]) for r in rounds)
    nominal = (
        f" The nominal case is {case_text(folder, loop['cases'][0])}; robust_layout.json has all digits."
    )
    stood = "" if all(r["cases"] for r in rounds) else f" {NONE} in the table: {STOOD}."
    more = stood + nominal
    return Figure(
        id="loop-rounds",
        title="Bound and worst case, round by round",
        alt=f"Bound of the known cases and worst case found over {len(rounds)} rounds; excess {said}.",
        read_off=f"The loop is closed when an attack finds nothing noticeably above the bound.{more}",
        panels=(
            Panel(draw=lambda ax: plot_rounds(rounds, label=label, unit=unit, ax=ax), width=5.6, height=2.8),
        ),
        table=Table(
            id="loop-rounds",
            title="Rounds",
            columns=(
                Column(name="round"), Column(name="cases"), Column(name="layout"),
                Column(name="bound", unit=unit), Column(name="worst found", unit=unit),
                Column(name="excess [%]"), Column(name="runs"), Column(name="worst case"),
            ),
            rows=tuple(
                (
                    k + 1, r["cases"] or NONE, r["layout"], r["bound"], r["worst"], 100 * r["gap"], r["runs"],
                    case_text(folder, r["case"], loop["cases"][0]),
                )
                for k, r in enumerate(rounds)
            ),
        ),
    )  # fmt: skip


def _cases(folder: CampaignFolder, loop: Mapping[str, Any], unit: str) -> Table:
    shown = [name for name in loop["layouts"] if name in (*PLAIN, loop["robust"])]
    names = sorted(shown, key=lambda name: -loop["layouts"][name]["worst"])
    return Table(
        id="loop-cases",
        title="The layouts compared, in every case found",
        columns=(
            Column(name="case"), *(Column(name=name, unit=unit) for name in names), Column(name="parameters")
        ),
        rows=tuple(
            (
                "nominal" if k == 0 else str(k),
                *(loop["layouts"][name]["values"][k] for name in names),
                case_text(folder, case, loop["cases"][0]),
            )
            for k, case in enumerate(loop["cases"])
        ),
    )  # fmt: skip


def _variants(loop: Mapping[str, Any], unit: str) -> Table:
    return Table(
        id="loop-variants",
        title="Other layout problems in the same cases",
        columns=(
            Column(name="problem"), Column(name="worst", unit=unit), Column(name="fractional members"),
            Column(name="purified", unit=unit), Column(name="fractional then"), Column(name="how it ended"),
        ),
        rows=tuple(
            (
                v["name"], v.get("worst"), v.get("fractional"), (v.get("purified") or {}).get("value"),
                (v.get("purified") or {}).get("fractional"), v.get("failure") or v.get("status"),
            )
            for v in loop["variants"]
        ),
    )  # fmt: skip


def _prices(loop: Mapping[str, Any], unit: str) -> list[Table]:
    rows = [
        (v["name"], b["name"], b["limit"], b["used"], v["shadow_prices"].get(b["name"]))
        for v in loop["variants"]
        if not v.get("failure")
        for b in v["budgets"]
    ]
    if not rows:
        return []
    return [
        Table(
            id="loop-prices",
            title="Budgets of the other problems and what one more unit would bring",
            columns=(
                Column(name="problem"), Column(name="budget"), Column(name="limit"), Column(name="used"),
                Column(name="shadow price", unit=unit),
            ),
            rows=tuple(rows),
        )
    ]  # fmt: skip


def screenings_table(loop: Mapping[str, Any]) -> Table:
    """Which parameters were seen to matter without the layout and with it, and which stay open."""
    found = loop["screening"]
    names = list(dict.fromkeys([*found["before"], *found["after"]]))
    # what noise hides may drive it all the same
    before, after = ("–" if was_resolved(found, before=is_before) else "open" for is_before in (True, False))
    return Table(
        id="loop-screening",
        title="Which parameters matter, before and with the layout",
        columns=(Column(name="parameter"), Column(name="without restraints"), Column(name="with the layout")),
        rows=tuple(
            (n, "yes" if n in found["before"] else before, "yes" if n in found["after"] else after)
            for n in names
        ),
    )

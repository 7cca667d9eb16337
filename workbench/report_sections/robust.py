"""Designs over the whole uncertainty: the same scenarios for all, quantiles, regret, price of robustness.

Reads `robust.json` as `ReEvaluation.to_dict` writes it.
"""

from collections.abc import Mapping
from typing import Any

from workbench.loop_plots import plot_differences, plot_distributions
from workbench.report_sections.blocks import (
    Block,
    Column,
    Figure,
    Note,
    Panel,
    Section,
    Table,
    number,
    quantity,
)
from workbench.report_sections.folder import CampaignFolder

__all__ = ["robust_section"]


def robust_section(folder: CampaignFolder) -> Section | None:
    """None without `robust.json`."""
    robust = folder["robust"]
    if robust is None:
        return None
    unit, designs = str(robust.get("unit") or "1"), list(robust["designs"])
    response = str(robust.get("response") or folder.main_response or "response")
    summaries = list(robust["summaries"])
    worst = [f"{s['design']} {quantity(s['worst'], unit)}" for s in summaries]
    sentences = [
        f"{len(designs)} designs met the same {robust['samples']} scenarios drawn from the uncertainty.",
        f"Worst {response} met: {', '.join(worst)}. A sample sees only part of the tail, so the true worst "
        "may be "
        "further out.",
    ]
    for name, (mean, low, high) in (robust.get("paired") or {}).items():
        sentences.append(
            f"Scenario by scenario, {name}: {quantity(mean, unit, 4)} on average, 95 % interval "
            f"{number(low, 4)} to "
            f"{number(high, 4)}."
        )
    screenings = list(robust.get("screenings") or [])
    if screenings:
        sentences.append("What matters to each design: " + "; ".join(s["sentence"] for s in screenings) + ".")
    failed = sum(int(s.get("failed") or 0) for s in summaries)
    blocks: list[Block] = []
    if failed:
        blocks.append(
            Note(
                text=f"{failed} runs gave no value; their scenarios are left out of all comparisons.",
                level="fair",
            )
        )
    blocks.append(_summaries(robust, summaries, response, unit))
    blocks.append(_distributions(robust, summaries, response, unit))
    if len(designs) >= 2:
        blocks.append(_pairs(robust, designs, response, unit))
    return Section(
        id="robust",
        title="Over the whole uncertainty",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={
            key: robust.get(key)
            for key in ("designs", "samples", "limit", "unit", "paired", "summaries", "screenings")
        },
    )


def _summaries(robust: Mapping[str, Any], summaries: list[dict[str, Any]], response: str, unit: str) -> Table:
    quantiles = list(dict.fromkeys(q for s in summaries for q in s["quantiles"]))
    limit = robust.get("limit")
    columns = [Column(name="design"), Column(name="mean", unit=unit)]
    columns += [Column(name=q, unit=unit) for q in quantiles]
    columns += [Column(name="worst met", unit=unit), Column(name="mean regret", unit=unit)]
    columns += [Column(name="largest regret", unit=unit), Column(name="at nominal", unit=unit)]
    columns += [Column(name="price of robustness", unit=unit)]
    if limit is not None:
        columns.append(Column(name=f"beyond {quantity(limit, unit)} (95 % interval)"))

    def beyond(s: Mapping[str, Any]) -> str:
        share = s.get("beyond_limit")
        return (
            "–"
            if share is None
            else f"{100 * share[0]:.1f} % ({100 * share[1]:.1f} to {100 * share[2]:.1f} %)"
        )

    return Table(
        id="robust",
        title=f"{response} of each design over the uncertainty",
        columns=tuple(columns),
        rows=tuple(
            (
                s["design"],
                s["mean"],
                *((s["quantiles"].get(q) or [None])[0] for q in quantiles),
                s["worst"],
                s["mean_regret"],
                s["largest_regret"],
                s.get("nominal"),
                s.get("price_of_robustness"),
                *([beyond(s)] if limit is not None else []),
            )
            for s in summaries
        ),
    )


def _distributions(
    robust: Mapping[str, Any], summaries: list[dict[str, Any]], response: str, unit: str
) -> Figure:
    values, limit = robust["values"], robust.get("limit")
    said = ", ".join(f"{s['design']} {number(s['mean'])}" for s in summaries)
    better = "left" if robust.get("sense", "max") == "max" else "right"
    return Figure(
        id="distributions",
        title=f"Distribution of {response}",
        alt=f"Shares of scenarios at or below a value for each design; means: {said}.",
        read_off=f"A curve further {better} is better everywhere; look at its upper end for the rare bad "
        "scenarios."
        + ("" if limit is None else f" The dotted line is the limit of {quantity(limit, unit)}."),
        panels=(
            Panel(
                draw=lambda ax: plot_distributions(values, limit=limit, label=response, unit=unit, ax=ax),
                width=6.0,
                height=3.0,
            ),
        ),
        table=Table(
            id="distributions",
            title=f"Quantiles of {response} with 95 % intervals",
            columns=(
                Column(name="design"), Column(name="quantile"), Column(name="value", unit=unit),
                Column(name="lower", unit=unit), Column(name="upper", unit=unit),
            ),
            rows=tuple((s["design"], q, *triple) for s in summaries for q, triple in s["quantiles"].items()),
        ),
    )  # fmt: skip


def _pairs(robust: Mapping[str, Any], designs: list[str], response: str, unit: str) -> Figure:
    a, b = designs[0], designs[-1]
    values = robust["values"]
    both = [
        (k, x, y)
        for k, (x, y) in enumerate(zip(values[a], values[b], strict=True))
        if x is not None and y is not None
    ]
    smaller = sum(y <= x for _, x, y in both)
    return Figure(
        id="pairs",
        title=f"{a} and {b} in the same scenarios",
        alt=f"{response} of {b} against {a} in {len(both)} scenarios; {b} is not larger in {smaller}.",
        read_off=f"Each mark is one scenario. Below the dashed line {b} has the smaller {response}; crosses "
        "above it "
        "are scenarios that pay for the change.",
        panels=(
            Panel(
                draw=lambda ax: plot_differences(values[a], values[b], names=(a, b), unit=unit, ax=ax),
                width=4.4,
                height=3.6,
            ),
        ),
        table=Table(
            id="pairs",
            title=f"{response} of both designs in each scenario",
            columns=(
                Column(name="scenario"),
                Column(name=a, unit=unit),
                Column(name=b, unit=unit),
                Column(name="difference", unit=unit),
            ),
            rows=tuple((k + 1, x, y, y - x) for k, x, y in both),
        ),
    )

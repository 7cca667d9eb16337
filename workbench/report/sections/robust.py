"""Designs over the whole uncertainty: the same scenarios for all, quantiles, regret, price of robustness.

Reads `robust.json` as `ReEvaluation.to_dict` writes it.
"""

from collections.abc import Mapping
from typing import Any

from workbench.figures.loop import plot_differences, plot_distributions
from workbench.report.lines.statements import sentence
from workbench.report.page.blocks import (
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
from workbench.report.page.folder import CampaignFolder

__all__ = ["robust_section"]


def robust_section(folder: CampaignFolder) -> Section | None:
    """None without `robust.json`."""
    robust = folder["robust"]
    if robust is None:
        return None
    unit, designs = str(robust.get("unit") or "1"), list(robust["designs"])
    response = str(robust.get("response") or folder.main_response or "response")
    summaries = list(robust["summaries"])
    worst = [f"{s['design']} {quantity(s.get('worst_run', s['worst']), unit)}" for s in summaries]
    drawn = int(robust.get("drawn") or robust["samples"])
    given = int(robust["samples"]) - drawn
    met = f"{drawn} scenarios drawn from the uncertainty" + (f" and {given} given ones" if given else "")
    sentences = [
        f"{len(designs)} designs met the same {met}." if len(designs) > 1 else f"{designs[0]} met {met}.",
        f"Worst {response} met: {', '.join(worst)}. A sample sees only part of the tail, so the true worst "
        "may be further out.",
    ]
    for name, (mean, low, high) in (robust.get("paired") or {}).items():
        sentences.append(
            f"Scenario by scenario, {name}: {quantity(mean, unit, 4)} on average, 95 % interval "
            f"{number(low, 4)} to {number(high, 4)}."
        )
    sentences += _price(robust, summaries, unit)
    screenings = list(robust.get("screenings") or [])
    if screenings:
        sentences.append("What matters to each design: " + "; ".join(s["sentence"] for s in screenings) + ".")
    blocks: list[Block] = [Note(text=text, level="fair") for text in _left_out(robust, summaries)]
    blocks.append(_summaries(robust, summaries, response, unit))
    blocks.append(_distributions(robust, summaries, response, unit))
    if len(designs) >= 2:
        blocks.append(_pairs(robust, designs, response, unit))
    if robust.get("nominal"):
        blocks.append(_nominal(robust["nominal"], folder))
    return Section(
        id="robust",
        title="Over the whole uncertainty",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={
            key: robust.get(key)
            for key in (
                "designs", "samples", "drawn", "left_out", "inadmissible", "nominal", "limit", "unit",
                "paired", "warnings", "summaries", "screenings",
            )
        },
    )  # fmt: skip


def _left_out(robust: Mapping[str, Any], summaries: list[dict[str, Any]]) -> list[str]:
    """Which scenarios are left out of the comparison and why, and what that may hide."""
    said = []
    inadmissible = robust.get("inadmissible") or {}
    if any(inadmissible.values()):
        each = ", ".join(f"{name} {count}" for name, count in inadmissible.items())
        said.append(
            "Scenarios that break a constraint with a design are not failures; they were run for no design: "
            f"{each}."
        )
    if left_out := robust.get("left_out"):
        each = ", ".join(f"{s['design']} {s['failed']}" for s in summaries)
        said.append(
            f"Left out of all comparisons, for every design: {left_out} of {robust['drawn']} scenarios, in "
            f"which a run gave no value ({each})."
        )
    return said + [sentence(text) for text in robust.get("warnings") or ()]


def _price(robust: Mapping[str, Any], summaries: list[dict[str, Any]], unit: str) -> list[str]:
    """What each design costs at the nominal scenario, beside the best of them there."""
    priced = [s for s in summaries if s.get("price_of_robustness") is not None]
    if len(priced) < 2:
        return []
    each = [
        f"{s['design']} {quantity(s['price_of_robustness'], unit, 4)} (it gives "
        f"{quantity(s['nominal'], unit, 4)})"
        for s in priced
    ]
    return [f"Price of robustness, the distance to the best design at nominal: {', '.join(each)}."]


def _nominal(nominal: Mapping[str, Any], folder: CampaignFolder) -> Table:
    return Table(
        id="robust-nominal",
        title="The nominal scenario",
        columns=(Column(name="parameter"), Column(name="value"), Column(name="unit")),
        rows=tuple((name, value, folder.unit_of(name)) for name, value in nominal.items()),
        folded=True,
    )


def _summaries(robust: Mapping[str, Any], summaries: list[dict[str, Any]], response: str, unit: str) -> Table:
    quantiles = list(dict.fromkeys(q for s in summaries for q in s["quantiles"]))
    limit = robust.get("limit")
    columns = [Column(name="design"), Column(name="mean", unit=unit)]
    columns += [Column(name=q, unit=unit) for q in quantiles]
    columns += [Column(name="worst met in common", unit=unit), Column(name="mean regret", unit=unit)]
    columns += [Column(name="largest regret", unit=unit), Column(name="at nominal", unit=unit)]
    columns += [Column(name="price of robustness", unit=unit)]
    shares = {} if limit is None else {"beyond_limit": f"beyond {quantity(limit, unit)} (95 % interval)"}
    if any(s.get("failed") for s in summaries):
        shares["failed_share"] = "failed (95 % interval)"
        if limit is not None:
            shares["beyond_or_failed"] = "beyond or failed (95 % interval)"
    columns += [Column(name=heading) for heading in shares.values()]

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
                *(_share(s.get(key)) for key in shares),
            )
            for s in summaries
        ),
    )


def _share(share: list[float] | None) -> str:
    if share is None:
        return "–"
    return f"{100 * share[0]:.1f} % ({100 * share[1]:.1f} to {100 * share[2]:.1f} %)"


def _common(robust: Mapping[str, Any]) -> dict[str, list[float | None]]:
    """Values of every design, None for all where one has none: curves show what the statistics rest on."""
    values = robust["values"]
    whole = [None not in row for row in zip(*values.values(), strict=True)]
    return {
        name: [v if kept else None for v, kept in zip(column, whole, strict=True)]
        for name, column in values.items()
    }


def _distributions(
    robust: Mapping[str, Any], summaries: list[dict[str, Any]], response: str, unit: str
) -> Figure:
    drawn, limit = int(robust.get("drawn") or robust["samples"]), robust.get("limit")
    values = {name: column[:drawn] for name, column in _common(robust).items()}
    said = ", ".join(f"{s['design']} {number(s['mean'])}" for s in summaries)
    better, bad = ("left", "upper") if robust.get("sense", "max") == "max" else ("right", "lower")
    return Figure(
        id="distributions",
        title=f"Distribution of {response}",
        alt=f"Shares of scenarios at or below a value for each design; means: {said}.",
        read_off=f"A curve further {better} is better everywhere; look at its {bad} end for the rare bad "
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
    values = _common(robust)
    both = [
        (k, x, y)
        for k, (x, y) in enumerate(zip(values[a], values[b], strict=True))
        if x is not None and y is not None
    ]
    smaller = sum(y <= x for _, x, y in both)
    paying = (
        "crosses above it are"
        if robust.get("sense", "max") == "max"
        else "dots below it, where it differs, are"
    )
    return Figure(
        id="pairs",
        title=f"{a} and {b} in the same scenarios",
        alt=f"{response} of {b} against {a} in {len(both)} scenarios; {b} is not larger in {smaller}.",
        read_off=f"Each mark is one scenario. Below the dashed line {b} has the smaller {response}; {paying} "
        "scenarios that pay for the change.",
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

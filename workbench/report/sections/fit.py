"""How far the Kriging can be trusted: leave-one-out prediction, Q2, coverage, a banner when poor."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.figures.fit import plot_predicted, plot_quantiles, plot_standardised
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Level,
    Note,
    Panel,
    Section,
    Table,
    number,
    percent,
)
from workbench.report.page.folder import CampaignFolder

__all__ = ["Trust", "fit_section", "trust_in"]

GOOD_Q2, FAIR_Q2 = 0.8, 0.5
NOMINAL = 0.95
UNUSUAL = 0.01  # a count of bars that miss this unlikely says that the bars are wrong


@dataclass(frozen=True, slots=True, kw_only=True)
class Trust:
    """The verdict on a fit: level, two words, and a sentence."""

    level: Level
    word: str
    sentence: str


def trust_in(leave_one_out: Mapping[str, Any]) -> Trust:
    """The verdict on leave-one-out figures.

    Q2 >= 0.8 is good, >= 0.5 fair, below poor. The 95 % bars count as wrong when so many miss as would happen
    in less than 1 % of sound fits (binomial law).
    """
    q2 = leave_one_out.get("q2")
    if q2 is None or not math.isfinite(q2):
        return Trust(level="poor", word="unknown", sentence="Q² could not be computed.")
    level: Level = "good" if q2 >= GOOD_Q2 else "fair" if q2 >= FAIR_Q2 else "poor"
    explained = percent(max(q2, 0.0), 1 if q2 > 0.99 else 0)
    sentence = (
        f"Leaving each run out in turn, the Kriging predicts {explained} of the variance of the response (Q² "
        f"= {number(float(q2), 3)})"
    )
    coverage, n = leave_one_out.get("coverage95"), len(leave_one_out["observed"])
    if coverage is not None:
        sentence += f"; {percent(coverage)} of the {n} runs lie in their 95 % bar"
        missed = round((1.0 - coverage) * n)
        if _at_least(missed, n, 1.0 - NOMINAL) < UNUSUAL:
            level = "fair" if level == "good" else level
            sentence += ", fewer than there should be: the bars are too short"
    word = {"good": "good", "fair": "fair", "poor": "poor"}[level]
    return Trust(level=level, word=word, sentence=sentence + ".")


def _at_least(k: int, n: int, p: float) -> float:
    """Chance of k or more successes in n trials."""
    return 1.0 - sum(math.comb(n, i) * p**i * (1.0 - p) ** (n - i) for i in range(k))


def fit_section(folder: CampaignFolder) -> Section | None:
    """None without leave-one-out figures."""
    screening = folder["screening"]
    loo = None if screening is None else screening.get("leave_one_out")
    if screening is None or not loo:
        return None
    trust = trust_in(loo)
    response, unit = str(screening["response"]), str(screening.get("unit") or "1")
    blocks: list[Block] = []
    if trust.level == "poor":
        blocks.append(
            Note(
                text="The Kriging predicts runs that it has not seen poorly. What it says about effects and "
                "about places without runs is a guess; only confirmed runs count. More runs would help.",
                level="poor",
            )
        )
    blocks.append(_triptych(folder, loo, response, unit))
    kriging = screening.get("kriging") or {}
    sentences = [trust.sentence]
    if kriging:
        sentences.append(
            f"Kriging with {kriging.get('correlation')} correlation and {kriging.get('trend')} trend"
            f"{_of_scale(kriging)}; "
            f"process variance {number(kriging.get('sigma2'))}, nugget {number(kriging.get('nugget'), 3)}."
        )
    return Section(
        id="fit",
        title="How far the Kriging can be trusted",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={"q2": loo.get("q2"), "coverage95": loo.get("coverage95"), "verdict": trust.word},
    )


def _of_scale(kriging: Mapping[str, Any]) -> str:
    """The scale of the response that the Kriging is of."""
    if kriging.get("scale", "none") == "none":
        return ""
    return f", of the response on the scale {kriging['scale_in_words']}, carried back to its unit"


def _triptych(folder: CampaignFolder, loo: Mapping[str, Any], response: str, unit: str) -> Figure:
    q2, coverage = number(loo.get("q2"), 3), loo.get("coverage95")
    inside = "–" if coverage is None else percent(coverage)
    keys = list(loo.get("run_ids") or range(1, len(loo["observed"]) + 1))
    width, height = 3.7, 3.2

    def predicted(ax: Any) -> Any:
        return plot_predicted(loo, label=response, unit=unit, ax=ax)

    return Figure(
        id="leave-one-out",
        title=f"Leave-one-out check: Q² = {q2}, {inside} inside the 95 % bars",
        alt=f"Three drawings of {len(keys)} leave-one-out predictions of {response}: against the true "
        f"values, standardised errors, and their quantiles. Q² is {q2}, coverage {inside}.",
        read_off="Left: on the dashed line a prediction is perfect. Middle: errors should scatter without a "
        "pattern, about one in twenty outside the band. Right: points off the line say that the stated bars "
        "are too short or too long.",
        panels=(
            Panel(draw=predicted, width=width, height=height),
            Panel(draw=lambda ax: plot_standardised(loo, ax=ax), width=width, height=height),
            Panel(draw=lambda ax: plot_quantiles(loo, ax=ax), width=width, height=height),
        ),
        table=Table(
            id="leave-one-out",
            title="Leave-one-out predictions",
            columns=(
                Column(name="run"),
                Column(name="true", unit=unit),
                Column(name="predicted without it", unit=unit),
                Column(name="standard deviation", unit=unit),
                Column(name="error in standard deviations"),
            ),
            rows=tuple(
                zip(
                    [folder.run_name(k) if isinstance(k, str) and len(k) > 12 else k for k in keys],
                    loo["observed"], loo["predicted"], loo["std"], loo["standardised"],
                    strict=True,
                )
            ),
        ),
    )  # fmt: skip

"""The worst case: where it lies, which run confirms it, how it was found, and how much worse it could be."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from workbench.report.lines.statements import (
    ended_text,
    failure_of,
    known_text,
    limits_text,
    quantile_text,
    sentence,
    worst_digits,
)
from workbench.report.page.blocks import (
    Block,
    Figure,
    Note,
    Section,
    number,
    quantity,
    typeset,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.worst_case.figures import (
    baseline_figures,
    profile_figure,
    search_figure,
    surprise_figure,
)
from workbench.report.worst_case.gap_figure import gap_figure
from workbench.report.worst_case.parallel_figure import parallel_figure
from workbench.report.worst_case.tables import audit_blocks, place_table, quantile_table, ranked_runs
from workbench.report.worst_case.worse_runs import later_sentence, worse_run

__all__ = ["further_worst_cases", "gap_sentence", "worst_case_section"]

UNCONFIRMED = (
    "Unconfirmed: no run was made at this point. It is the extreme of the surrogate alone; run the model "
    "there before relying on it."
)


def gap_sentence(worst: Mapping[str, Any], later: tuple[float, str] | None = None) -> str:
    """What is known about how much worse it could be; `later`: value and key of a run that is worse."""
    gap = worst.get("gap")
    upper = (gap or {}).get("upper")
    if later is not None and upper is not None:
        sign = 1.0 if worst["sense"] == "max" else -1.0
        if sign * (later[0] - upper) > 0:
            return "The bound on how much worse it could be, stated by the search, does not hold."
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
    history = list(worst.get("history") or [])
    blocks: list[Block] = [] if worst["confirmed"] else [Note(text=UNCONFIRMED, level="fair")]
    blocks.append(place_table(folder, worst, unit))
    if worst.get("quantile"):
        blocks.append(quantile_table(folder, worst["quantile"], response, unit))
    if history:
        blocks += ranked_runs(folder, worst, history, response, unit)
        blocks.append(search_figure(folder, worst, history, response, unit))
        closing = gap_figure(worst, history, response, unit)
        blocks += [] if closing is None else [closing]
    if worst.get("profile"):
        blocks.append(profile_figure(folder, worst, history, response, unit))
    if any(h.get("predicted") is not None and h.get("value") is not None for h in history):
        blocks.append(surprise_figure(worst, history, response, unit))
    parallel = parallel_figure(folder, worst, response)
    blocks += [] if parallel is None else [parallel]
    if worst["confirmed"]:
        blocks += baseline_figures(folder, worst, response, unit)
    blocks += audit_blocks(folder, worst)
    return Section(
        id="worst-case",
        title="The worst case",
        sentences=tuple(_sentences(folder, worst)),
        blocks=tuple(blocks),
        numbers={
            key: worst.get(key)
            for key in (
                "response", "unit", "sense", "value", "parameters", "confirmed", "label", "run_key",
                "predicted", "predicted_std", "evaluations", "budget", "failures", "gap", "baselines",
                "quantile", "grade", "attack", "mean", "interval", "repeats", "noise", "border",
            )
        },
    )  # fmt: skip


def _sentences(folder: CampaignFolder, worst: Mapping[str, Any]) -> list[str]:
    """Value, limits, grade, gap, quantile, why the search ended, failed runs."""
    response, unit = str(worst["response"]), str(worst.get("unit") or "1")
    side = "largest" if worst["sense"] == "max" else "smallest"
    confirmed, is_mean = bool(worst["confirmed"]), worst.get("mean") is not None
    failure, sentences = failure_of(worst), []
    if failure is not None:
        lost = folder.run_name(failure["run_key"])
        sentences.append(f"The worst case is {lost}, which failed; the table shows where it lies.")
    digits = worst_digits(worst, show=number)
    of = "" if failure is None else " of the runs that gave a value"
    sentences.append(
        f"The {side} {response}{of} is {quantity(worst['value'], unit, digits)}, {worst['label']}"
        + (f": {folder.run_name(worst.get('run_key'))}." if confirmed and not is_mean else ".")
    )
    if known := known_text(worst):
        sentences.append(sentence(known))
    if is_mean:
        noise = quantity(worst["noise"], unit)
        sentences.append(
            f"Runs have noise: {noise} (standard deviation at this point). The runs by which the point was "
            "chosen have no part in the mean; a single run beyond it is luck."
        )
    later = worse_run(folder, worst)
    if later is not None:
        sentences.append(later_sentence(folder, later, unit))
    if worst.get("border"):
        sentences.append(typeset(worst["border"]["sentence"]))
    if worst.get("within"):
        sentences.append(f"Only runs with {limits_text(worst['within'])} count; others are called excluded.")
    sentences += [typeset(f"{mode['sentence']}.") for mode in worst.get("modes") or ()]
    if confirmed:
        sentences += [typeset(worst["grade_sentence"])] if worst.get("grade_sentence") else []
    sentences.append(gap_sentence(worst, later))
    if worst.get("regime"):
        sentences.append(typeset(worst["regime"]))
    if worst.get("scale"):
        sentences.append(worst["scale"]["reason"])
    if worst.get("quantile"):
        said = quantile_text(worst["quantile"])
        sentences.append(sentence(said))
    if ended := ended_text(worst):
        sentences.append(f"Why the search ended: {ended}." if worst.get("budget") else sentence(ended))
    failures = {k: n for k, n in (worst.get("failures") or {}).items() if n}
    if failures:
        sentences.append(
            "Runs without a value: " + ", ".join(f"{n} {k}" for k, n in sorted(failures.items())) + "."
        )
    return sentences

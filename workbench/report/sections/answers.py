"""The first screen: each question of the study with its answer in a plain sentence."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from workbench.models.stored.evaluation import FAILED
from workbench.report.layout.section import improvement_sentence
from workbench.report.lines.design import table_sentences
from workbench.report.lines.statements import (
    border_text,
    failure_of,
    known_text,
    minor_text,
    open_text,
    regime_text,
    scale_text,
    screening_state,
    sentence,
    state_text,
    worst_digits,
)
from workbench.report.page.blocks import (
    Card,
    Level,
    names_of,
    number,
    percent,
    quantity,
    typeset,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.fit import GOOD_Q2, trust_in
from workbench.report.sections.green_answers import GREEN_GRADES, refuse_green
from workbench.report.sections.runs import runs_of_layouts
from workbench.report.sections.screening import verdict_level
from workbench.report.worst_case.section import gap_sentence
from workbench.report.worst_case.worse_runs import ROUNDING, later_sentence, worse_run

__all__ = ["answer_cards", "question"]


def question(folder: CampaignFolder) -> str:
    """What was asked, in one sentence."""
    count = len(folder.parameters)
    what = f"the {count} uncertain parameters" if count else "the uncertain parameters"
    response, worst = folder.main_response, folder["worst_case"]
    if response is None:
        return f"What do {what} do?"
    asked = f"Which of {what} drive {response}"
    if not _asks_which(folder):
        if worst is None:
            return f"What do {what} do to {response}?"
        size = "large" if worst["sense"] == "max" else "small"
        return f"How {size} can {worst['response']} get over {what}?"
    if worst is None:
        return f"{asked}?"
    what = "it" if worst["response"] == response else worst["response"]
    return f"{asked}, and how {'large' if worst['sense'] == 'max' else 'small'} can {what} get?"


def _asks_which(folder: CampaignFolder) -> bool:
    """Whether a screening was asked for, or made without being asked for in the study."""
    made = any(folder.documents.get(name) is not None for name in ("screening", "sensitivity"))
    return made or bool(folder.lock.get("resolved", {}).get("screen"))


def answer_cards(folder: CampaignFolder) -> list[Card]:
    """One card per stage that has run."""
    cards = []
    loop = folder["robust_layout"]
    cards += [_worst(folder, found, loop, section=name) for name, found in _worst_by_section(folder).items()]
    if (layout := folder["layout"]) is not None:
        cards.append(_no_better_than(loop, _layout(layout, is_judged=loop is not None)))
    if (robust := folder["robust"]) is not None:
        cards.append(_no_better_than(loop, _robust(robust, attacked=_attacked(loop))))
    if (screening := folder["screening"]) is not None:
        cards.append(_screening(screening))
        if screening.get("leave_one_out"):
            cards.append(_trust(screening))
    if len(folder.runs):
        cards.append(_runs(folder))
    if screening is not None and screening_state(screening) == "not resolved":
        # what rests on a doubtful list of parameters comes behind the doubt
        cards.sort(key=lambda card: card.section != "screening")
    refuse_green(
        {card.section: card.level for card in cards},
        screening="" if screening is None else screening_state(screening), layout=layout, loop=loop,
        robust=folder["robust"], worst=_worst_by_section(folder),
    )  # fmt: skip
    return cards


def _worst_by_section(folder: CampaignFolder) -> dict[str, Mapping[str, Any]]:
    """The worst cases of a study by the sections of their cards."""
    worst = folder["worst_case"]
    if worst is None:
        return {}
    others = worst.get("others") or ()
    return {"worst-case": worst, **{f"worst-case-{other['response']}": other for other in others}}


def _trust(screening: Mapping[str, Any]) -> Card:
    """How well the Kriging predicts; never better than the list of parameters that it rests on."""
    trust, state = trust_in(screening["leave_one_out"]), screening_state(screening)
    level, answer = trust.level, {"good": "It predicts well.", "fair": "With care.", "poor": "Not far."}
    said, detail = answer.get(trust.word, "Unknown."), trust.sentence
    if level == "good" and state == "not resolved":
        level, said = "fair", "With care."
        detail += " Which parameters it should hold is not resolved."
    elif level == "good" and state == "partly resolved":
        level = "plain"
    return Card(
        question="How far can the Kriging be trusted?",
        answer=said,
        detail=detail,
        section="fit",
        level=level,
    )


def _no_better_than(loop: Mapping[str, Any] | None, card: Card) -> Card:
    """A card on the robust layout, good only where the verdict of the loop that made it is green."""
    if loop is None or loop.get("verdict", "green") == "green":
        return card
    detail = f"{card.detail} But {'; '.join(loop['reasons'])}."
    if not loop["closed"]:
        off = loop["may_exceed"]
        detail += (
            " How much more another attack may find is not known." if off is None
            else f" Another attack may find {percent(off, 1)} more."
        )  # fmt: skip
    return replace(card, detail=detail, level="fair" if card.level == "good" else card.level)


def _beyond(
    folder: CampaignFolder,
    worst: Mapping[str, Any],
    loop: Mapping[str, Any] | None,
    later: tuple[float, str] | None,
) -> str:
    """The run of another stage that goes beyond a worst case, or ""."""
    unit = str(worst.get("unit") or "1")
    if later is not None:
        return later_sentence(folder, later, unit)
    bare = ((loop or {}).get("layouts") or {}).get("none") or {}
    known, sign = bare.get("worst"), 1.0 if worst["sense"] == "max" else -1.0
    if loop is None or known is None or loop["response"] != worst["response"]:
        return ""
    if sign * (known - worst["value"]) <= ROUNDING * abs(worst["value"]):
        return ""
    return f"A run of the robust loop without a layout went to {quantity(known, unit)}."


def _worst(
    folder: CampaignFolder, worst: Mapping[str, Any], loop: Mapping[str, Any] | None, *, section: str
) -> Card:
    response, unit = str(worst["response"]), str(worst.get("unit") or "1")
    confirmed = bool(worst["confirmed"])
    border = worst.get("border") or {}
    if confirmed:
        later = worse_run(folder, worst)
        detail = f"{_confirmed_by(folder, worst)}. {gap_sentence(worst, later)}"
        beyond = _beyond(folder, worst, loop, later)
        if border.get("borders") or border.get("is_answer"):
            detail = f"{border['sentence']} {detail}"
        level: Level = (
            "fair"
            if beyond or border.get("is_answer")
            else "plain"
            if worst.get("grade") not in GREEN_GRADES or border.get("borders")
            else "good"
        )
        detail = " ".join(part for part in (detail, worst.get("grade_sentence"), beyond) if part)
    else:
        std = worst.get("predicted_std")
        bar = f" (standard deviation {quantity(std, unit, 3)})" if isinstance(std, (int, float)) else ""
        known = known_text(worst)
        detail = f"Surrogate only, unconfirmed: no run was made there{bar}. Run the model at this point."
        detail += f" {sentence(known)}" if known else ""
        level = "fair"
    kind = str(worst.get("regime_name") or "")
    value = f"{response} = {quantity(worst['value'], unit, worst_digits(worst, show=number))}"
    answer = f"{kind[0].upper()}{kind[1:]}: {value}" if kind else value
    failure = failure_of(worst)
    if failure is not None:
        answer = f"{folder.run_name(failure['run_key']).capitalize()} fails; of the others: {value}"
    return Card(
        question=f"How {'large' if worst['sense'] == 'max' else 'small'} can {response} get?",
        answer=answer,
        detail=detail,
        section=section,
        level=level,
    )


def _confirmed_by(folder: CampaignFolder, worst: Mapping[str, Any]) -> str:
    """Which true run gave the value, and whether the search made it or knew it from before."""
    runs, key = f"{worst['evaluations']} runs of the search", worst.get("run_key")
    if worst.get("mean") is not None:
        return f"{worst['label'][:1].upper()}{worst['label'][1:]}, after {runs}"
    own = [run.get("iteration") for run in worst.get("history") or () if run.get("run_key") == key]
    lead = "Confirmed by a true run" if failure_of(worst) is None else "The worst that gave a value"
    said = f"{lead}: {folder.run_name(key)}"
    if not worst.get("budget"):  # a table: nothing was searched
        return said
    return f"{said}, known before the {runs}" if own and not any(own) else f"{said}, after {runs}"


def _layout(layout: Mapping[str, Any], *, is_judged: bool) -> Card:
    """The card of a layout; of one that a loop has judged the loop says how far it was optimised."""
    unit = str(layout.get("unit") or "1")
    baselines = layout.get("baselines") or {}
    better = all(float(layout["value"]) < float(value) for value in baselines.values())
    detail = improvement_sentence(layout)
    settled = is_judged or layout.get("converged", True)
    if not settled:
        detail = f"{detail} The optimiser stopped at its limit: a better layout may stand nearby."
    return Card(
        question="Which layout holds fast in it?",
        answer=f"worst {layout['response']} {quantity(layout['value'], unit)}",
        detail=detail,
        section="layout",
        level="good" if baselines and better and settled else "fair",
    )


def _attacked(loop: Mapping[str, Any] | None) -> str:
    """How the layout of a closed loop was attacked, or ""."""
    return "" if loop is None or not loop.get("closed") else typeset(str(loop.get("status", "")))


def _robust(robust: Mapping[str, Any], *, attacked: str) -> Card:
    """The card of designs over the uncertainty.    attacked: how the last of them was."""
    unit, last = str(robust.get("unit") or "1"), robust["summaries"][-1]
    first = robust["summaries"][0]
    sign = 1.0 if robust.get("sense", "max") == "max" else -1.0
    # all runs of a design count, also where others gave no value
    worst, at_first = (s.get("worst_run", s["worst"]) for s in (last, first))
    better = sign * (at_first - worst) >= 0
    beyond = last.get("beyond_limit")
    met = int(robust["samples"]) - int(last.get("failed") or 0)
    detail = f"Worst of {met} scenarios; with {first['design']} it was {quantity(at_first, unit)}."
    if beyond is not None:
        share, most = percent(beyond[0], 1), percent(beyond[2], 1)
        detail += f" {share} of scenarios exceed the limit (95 % interval up to {most})."
    doubtful = bool(robust.get("left_out") and robust.get("warnings"))
    if doubtful:
        detail += " Runs failed and may hide something worse."
    detail = f"{detail} {attacked}".rstrip()
    doubtful |= beyond is not None and beyond[0] > 0
    return Card(
        question="Does it hold over the whole uncertainty?",
        answer=f"{last['design']}: {quantity(worst, unit)} at worst",
        detail=detail,
        section="robust",
        level="poor" if not better else "fair" if doubtful else "good",
    )


def _screening(screening: Mapping[str, Any]) -> Card:
    selected, total = list(screening["selected"]), len(screening["ranking"])
    left = total - len(selected) - len(screening.get("minor") or [])
    said = state_text(screening)
    state = sentence(said)
    others = "The other one was" if left == 1 else f"The other {left} were"
    rest = f"{others} not selected." if left else "None was left out."
    unknown = not selected and screening_state(screening) == "not resolved"
    if unknown:
        rest = "That is no sign that none acts."
    q2 = (screening.get("leave_one_out") or {}).get("q2")
    # whatever the likelihood says: parameters that predict badly on their own are not all there are
    enough = q2 is None or q2 >= GOOD_Q2 or not left
    if q2 is not None and not enough:
        said = percent(max(float(q2), 0.0))
        rest += f" The selected ones alone predict {said} of the variance: others may matter too."
    return Card(
        question=f"Which parameters drive {screening['response']}?",
        answer=f"not known: none of {total} stands out from noise"
        if unknown
        else f"{len(selected)} of {total}: {names_of(selected, at_most=8)}",
        detail=" ".join(
            part
            for part in (
                state,
                scale_text(screening),
                *(sentence(said) for said in regime_text(screening)[:1]),
                minor_text(screening),
                open_text(screening),
                border_text(screening),
                rest,
                f"Judged on {screening['n_runs']} runs.",
                _first_advice(screening),
            )
            if part
        ),
        section="screening",
        level=_screening_level(screening, enough),
    )


def _first_advice(screening: Mapping[str, Any]) -> str:
    """What to do where the verdict is open, its first part."""
    if screening_state(screening) != "not resolved" or not screening.get("advice"):
        return ""
    return f"To do: {str(screening['advice']).split('; ')[0]}."


def _screening_level(screening: Mapping[str, Any], enough: bool) -> Level:
    """The screening's own verdict, toned down where the selected parameters predict badly."""
    level = verdict_level(screening)
    return "fair" if level in ("good", "plain") and not enough else level


def _runs(folder: CampaignFolder) -> Card:
    finished = len(folder.runs.finished)
    bad = len(folder.runs.with_status(*FAILED))
    waiting = len(folder.runs) - finished
    detail = "All of them gave a value."
    if bad:
        lie = "it lies" if bad == 1 else "they lie"
        detail = f'The section "What ran" says why {bad} gave no value, and where {lie} in the box.'
    if waiting:
        detail += f" {waiting} more are not finished."
    of_layouts = sum(runs_of_layouts(folder).values())
    looped = f" The robust loop made {of_layouts} further true runs, of layouts." if of_layouts else ""
    design = folder["design"] or {}
    detail += "".join(f" {sentence(said)}" for said in table_sentences(design))
    enough = not bad and not design.get("dwarfing")
    return Card(
        question="What ran?",
        answer=f"{finished} run{'' if finished == 1 else 's'}" + (f", {bad} without a value" if bad else ""),
        detail=f"{detail} CPU time {number(folder.runs.cpu, 3)} s.{looped}",
        section="runs",
        level="good" if enough else "poor" if bad > 0.2 * finished else "fair",
    )

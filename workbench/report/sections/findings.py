"""What a designer takes to a review: the findings of a robust loop in plain sentences, first on the page."""

import html
from collections.abc import Mapping
from typing import Any

from workbench.report.lines.requirements import requirement_text
from workbench.report.lines.statements import (
    border_text,
    minor_text,
    open_text,
    regime_name,
    regime_text,
    screening_state,
    sentence,
    share_of_variance,
    variance_text,
)
from workbench.report.page.blocks import (
    Block,
    Column,
    Html,
    Note,
    Section,
    Table,
    names_of,
    number,
    quantity,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.worst_case.worse_runs import ROUNDING

__all__ = ["after_text", "case_text", "findings_section", "was_resolved"]

UNSETTLED_BEFORE = "the runs without restraints do not settle"
REST = "the rest nominal"  # of a case that is told by what differs from the nominal one


def findings_section(folder: CampaignFolder) -> Section | None:
    """None without `robust_layout.json`."""
    loop = folder["robust_layout"]
    if loop is None:
        return None
    unit = str(loop.get("unit") or "1")
    findings = [
        *[requirement_text(asked, attacked=loop["response"]) for asked in loop.get("requirements", ())],
        *_unrestrained(folder, loop, unit),
        *_drivers(folder),
        *_layout(loop, unit),
        *_samples(folder, loop, unit),
        *after_text(loop),
        *_variants(loop, unit),
    ]
    blocks: list[Block] = [_listed(findings)]
    blocks += _verdict(loop)
    blocks += [Note(text=f"A case could not be used: {text}", level="fair") for text in loop["failures"]]
    blocks.append(_table(loop, unit))
    return Section(
        id="findings",
        title="What was found",
        sentences=(f"Of {loop['title']}:",),
        blocks=tuple(blocks),
        numbers={"layouts": {name: kept["worst"] for name, kept in loop["layouts"].items()}},
    )


def _verdict(loop: Mapping[str, Any]) -> list[Block]:
    """What keeps the loop from being green: an open one is a lower end, with the share it may be off by, if
    attacks were long enough to tell."""
    if loop["closed"] and not loop.get("broken_by_samples"):
        return [Note(text=sentence(said), level="fair") for said in loop["reasons"]]
    off = loop["may_exceed"]
    by = "by how much it may be off is not known" if off is None else f"it may be off by {100 * off:.3g} %"
    text = f"Treat the worst case as a lower end: {by}."
    rest = [said for said in loop["reasons"] if not said.startswith("the loop is not closed")]
    if loop.get("broken_by_samples"):
        rest.append("a sampled case lies beyond it")
    return [
        Note(
            text=" ".join([loop["status"], text, *map(sentence, rest)]),
            level="poor",
        )
    ]


def case_text(
    folder: CampaignFolder, case: Mapping[str, Any], nominal: Mapping[str, Any] | None = None
) -> str:
    """A case as a person reads it: what differs from the nominal one, in the order of the study, and that the
    rest does not; all of the nominal one itself, or without one.

    What the screening did not select goes last: it differs, but hardly matters.
    """
    names = [name for name in folder.parameters if name in case] or list(case)
    chosen = (folder["screening"] or {}).get("selected") or []
    names.sort(key=lambda name: name not in chosen)
    apart = [name for name in names if nominal is None or case[name] != nominal[name]]
    said = ", ".join(
        f"{name} = {number(case[name], 4)}"
        + ("" if folder.unit_of(name) == "1" else f" {folder.unit_of(name)}")
        for name in (apart or names)
    )
    return f"{said}, {REST}" if 0 < len(apart) < len(names) else said


def _listed(findings: list[str]) -> Html:
    items = "".join(f"<li>{html.escape(text)}</li>" for text in findings)
    return Html(
        id="finding-list", markup=f"<ol>{items}</ol>", text="\n".join(f"- {text}" for text in findings)
    )


def _unrestrained(folder: CampaignFolder, loop: Mapping[str, Any], unit: str) -> list[str]:
    bare = loop["layouts"].get("none")
    if bare is None:
        return []
    said = (
        f"Without restraints the {loop['response']} is {quantity(bare['nominal'], unit, 3)} in the nominal "
    )
    screening = folder["screening"]
    if screening is not None and screening["response"] != loop["response"]:
        screening = None
    kind = regime_name(float(bare["worst"]), screening)
    named = f" ({kind})" if kind else ""
    searched = _searched_further(folder, loop, bare)
    where = "found" if searched is None else "of the loop"
    said += f"case and {quantity(bare['worst'], unit, 3)}{named} in the worst one {where}"
    said += f" ({case_text(folder, bare['case'], loop['cases'][0])})"
    if searched is not None:
        said += (
            f"; the search for the worst case went to {quantity(searched['value'], unit, 3)} "
            f"({case_text(folder, searched['parameters'], loop['cases'][0])})"
        )
    return [said + "."]


def _searched_further(
    folder: CampaignFolder, loop: Mapping[str, Any], bare: Mapping[str, Any]
) -> Mapping[str, Any] | None:
    """The worst case of the study where it lies beyond every case of the loop, which may begin without it."""
    worst = folder["worst_case"] or {}
    for found in (worst, *(worst.get("others") or ())):
        if found.get("response") != loop["response"] or found["sense"] != "max" or not found["confirmed"]:
            continue
        if found["value"] - bare["worst"] > ROUNDING * abs(found["value"]):
            return found
    return None


def _drivers(folder: CampaignFolder) -> list[str]:
    screening = folder["screening"]
    if screening is None:
        return []
    chosen, ranking = list(screening["selected"]), list(screening["ranking"])
    rest = [name for name in ranking if name not in [*chosen, *(screening.get("minor") or [])]]
    verb = "drives" if len(chosen) == 1 else "drive"
    said = f"Of {len(ranking)} uncertain parameters {names_of(chosen, at_most=8)} {verb} it, on "
    if not chosen and screening_state(screening) == "not resolved":
        said = f"None of {len(ranking)} uncertain parameters stands out from noise, on "
    said += f"{screening['n_runs']} runs."
    parts = (
        said,
        minor_text(screening),
        open_text(screening),
        border_text(screening),
        _of_the_others(screening, rest) if rest else "",
    )
    regimes = " ".join(sentence(said) for said in regime_text(screening))
    return [" ".join(part for part in parts if part), *([regimes] if regimes else [])]


def _of_the_others(screening: Mapping[str, Any], rest: list[str]) -> str:
    """What may be said of the parameters that were not selected: never that they have no effect."""
    names, state = names_of(rest, at_most=12), screening_state(screening)
    of = variance_text(screening)
    share = screening.get("hidden_share")
    known = "" if share is None else share_of_variance(float(share))
    if state == "resolved":
        return f"Of {of} less than {known or 'what stays unexplained'} is due to any of {names}."
    if state == "partly resolved" and known:
        return f"Effects of up to {known} of {of} may hide in {names}."
    return f"These runs do not resolve which matter: effects may hide in {names}."


def _layout(loop: Mapping[str, Any], unit: str) -> list[str]:
    name = loop["robust"]
    kept, layouts = loop["layouts"][name], loop["layouts"]
    subject = "robust layout" if name == "robust" else f"layout '{name}'"
    said = [
        f"The {subject} keeps it at or below "
        f"{quantity(kept['worst'], unit, 4)} in every case found: {_beside(kept, layouts, unit)}."
    ]
    if "nominal only" in layouts and name == "robust":
        price = kept["nominal"] - layouts["nominal only"]["nominal"]
        said.append(
            f"In the nominal case that costs {quantity(price, unit, 3)} (price of robustness): "
            f"{quantity(kept['nominal'], unit, 4)} instead of "
            f"{quantity(layouts['nominal only']['nominal'], unit, 4)} with the one made for that case alone."
        )
    others = loop.get("other_starts")
    if others is not None:
        agrees = "agrees" if others["agrees"] else "does not agree"
        known = others.get("cases", len(loop["cases"]))
        where = "same cases"
        if known != len(loop["cases"]):
            where = f"{known} cases that were known when it was made"
        said.append(
            f"A layout optimised from another start reaches {quantity(others['worst'], unit, 4)} in the "
            f"{where}: it {agrees} within {100 * loop['tolerance']:.3g} %."
        )
    return [*said, str(loop["status"])]


def _beside(kept: Mapping[str, Any], others: Mapping[str, Any], unit: str) -> str:
    words = {
        "nominal only": "the layout made for the nominal case alone",
        "uniform": "the same budgets spread evenly",
    }
    found = []
    for name, what in words.items():
        if name in others and others[name] is not kept:
            worst, other = float(kept["worst"]), float(others[name]["worst"])
            side = "below" if worst <= other else "above"
            # a share of a number that is not positive says nothing, nor does a number that is not as one
            far = (
                f"{abs(100 * (1 - worst / other)):.3g} %"
                if min(worst, other) > 0
                else quantity(abs(worst - other), unit, 3)
            )
            found.append(f"{far} {side} {what} ({quantity(other, unit, 4)})")
    return " and ".join(found) or "nothing to compare it with"


def _samples(folder: CampaignFolder, loop: Mapping[str, Any], unit: str) -> list[str]:
    robust = folder["robust"]
    if robust is None:
        return []
    last, name = robust["summaries"][-1], loop["robust"]
    bound = loop["layouts"][name]["worst"]
    sampled = [v for v in robust["values"][last["design"]][: loop["samples"]] if v is not None]
    beyond = sum(v > bound for v in sampled)
    said = (
        f"Of {len(sampled)} sampled cases {'none' if beyond == 0 else beyond} went beyond that; "
        f"the median is {quantity(last['quantiles']['P50'][0], unit, 4)} and the 95 % quantile "
        f"{quantity(last['quantiles']['P95'][0], unit, 4)}."
    )
    first = robust["summaries"][0]
    return [
        said + f" With the layout '{first['design']}' the same cases have the 95 % quantile "
        f"{quantity(first['quantiles']['P95'][0], unit, 4)}."
    ]


def was_resolved(found: Mapping[str, Any], *, before: bool = False) -> bool:
    """Whether the screening with the layout, or the one `before` it, saw all that matters: what it did not
    select is out then. A document of old, without a state, does not say so.
    """
    return bool(found.get("state_before" if before else "state") == "resolved")


def after_text(loop: Mapping[str, Any]) -> list[str]:
    """What drives the response with the layout in, beside what did without; nothing without a screening."""
    found = loop.get("screening")
    if not found:
        return []
    if found["after"] is None:
        return [f"With the layout in, the screening told nothing: {found['reason']}."]
    is_resolved = was_resolved(found)
    if not found["after"] and not is_resolved:
        open_ = f": whether {names_of(found['lost'], at_most=8)} still do is open" if found["lost"] else ""
        return [f"With the layout in, none of the parameters stands out from noise on the same runs{open_}."]
    verb = "drives" if len(found["after"]) == 1 else "drive"
    said = f"With the layout in, {names_of(found['after'], at_most=8)} {verb} it"
    gained = "new:" if was_resolved(found, before=True) else f"seen only now, which {UNSETTLED_BEFORE}:"
    lost = "no longer" if is_resolved else "not seen any more, which these runs do not settle:"
    changes = [
        f"{word} {names_of(found[key], at_most=8)}"
        for key, word in (("gained", gained), ("lost", lost))
        if found[key]
    ]
    return [f"{said}; {'; '.join(changes)}." if changes else f"{said}, as before."]


def _variants(loop: Mapping[str, Any], unit: str) -> list[str]:
    said = []
    for variant in loop["variants"]:
        if variant.get("failure") or variant["worst"] is None:
            said.append(f"{variant['name'].capitalize()}: no layout was found.")
            continue
        text = f"{variant['name'].capitalize()}: {quantity(variant['worst'], unit, 4)} in the same cases"
        clean = variant.get("purified")
        if clean:
            text += f"; with {clean['fractional']} fractional members {quantity(clean['value'], unit, 4)}"
        said.append(text + ".")
    return said


def _table(loop: Mapping[str, Any], unit: str) -> Table:
    worst_first = sorted(loop["layouts"].items(), key=lambda item: (-item[1]["worst"], item[0]))
    return Table(
        id="findings",
        title=f"Worst {loop['response']} of every layout, by true runs",
        columns=(
            Column(name="layout"), Column(name="worst", unit=unit), Column(name="at nominal", unit=unit),
            Column(name="runs of its look or attack"),
        ),
        rows=tuple((name, kept["worst"], kept["nominal"], kept["runs"]) for name, kept in worst_first),
    )  # fmt: skip

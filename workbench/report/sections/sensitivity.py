"""Sensitivity indices by other methods, as `holdfast screen --method` left them: a table for each."""

from collections.abc import Mapping
from typing import Any

from workbench.report.page.blocks import Column, Section, Table, names_of, number
from workbench.report.page.folder import CampaignFolder
from workbench.screening.named_methods import named

__all__ = ["sensitivity_section"]

# key in the document -> heading
HEADINGS = {
    "main": "main",
    "main_lower": "main, lower",
    "main_upper": "main, upper",
    "total": "total",
    "total_lower": "total, lower",
    "total_upper": "total, upper",
    "value": "coefficient",
    "lower": "lower",
    "upper": "upper",
    "r2_hsic": "R2-HSIC",
    "p_value": "p-value of independence",
    "mu_star": "mean absolute effect",
    "mu": "mean effect",
    "sigma": "spread",
}
FIRST = 3  # parameters named in the sentence


def sensitivity_section(folder: CampaignFolder) -> Section | None:
    """None where nobody has looked by another method."""
    document = folder["sensitivity"]
    looks = [] if document is None else list(document["looks"])
    if not looks:
        return None
    sentences, tables = [], []
    for look in looks:
        sentences.append(_sentence(look))
        tables.append(_table(look))
        if look.get("interactions"):
            tables.append(_interactions(look))
    return Section(
        id="sensitivity",
        title="Indices by other methods",
        sentences=(
            "Looks at the same runs by methods asked for by name; indices of different methods measure "
            "different things, their rankings are comparable.",
            *sentences,
        ),
        blocks=tuple(tables),
        numbers={"looks": looks},
    )


def _sentence(look: Mapping[str, Any]) -> str:
    first = names_of(look["ranking"][:FIRST])
    rests = f"{look['n_runs']} runs"
    if "q2" in look:
        scale = look.get("scale", "none")
        of = "" if scale == "none" else f" of the response on another scale ({scale}), carried back,"
        rests += f" through a Kriging{of} with Q2 {number(look['q2'])}"
    if "r2" in look:
        rests += f" through a linear regression with R2 {number(look['r2'])}"
    return (
        f"{look['method']} of {look['response']}, {named(look['method']).gives}, from {rests}: first "
        f"{first}. "
        f"It cannot see {look['cannot_see']}."
    )


def _rows(look: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    if "indices" in look:
        return dict(look["indices"])
    return {name: {key: look[key][name] for key in ("mu_star", "mu", "sigma")} for name in look["ranking"]}


def _table(look: Mapping[str, Any]) -> Table:
    rows = _rows(look)
    keys = [key for key in HEADINGS if key in rows[look["ranking"][0]]]
    unit = str(look["unit"]) if look["method"] == "morris" else "1"
    return Table(
        id=f"indices-{look['method']}-{look['response']}",
        title=f"{look['method']} of {look['response']}",
        columns=(Column(name="parameter"), *(Column(name=HEADINGS[key], unit=unit) for key in keys)),
        rows=tuple((name, *(rows[name][key] for key in keys)) for name in look["ranking"]),
    )


def _interactions(look: Mapping[str, Any]) -> Table:
    return Table(
        id=f"interactions-{look['response']}",
        title=f"Interactions of pairs on {look['response']}",
        columns=(
            Column(name="parameter"),
            Column(name="with"),
            Column(name="share"),
            Column(name="lower"),
            Column(name="upper"),
        ),
        rows=tuple((*one["pair"], one["mean"], one["lower"], one["upper"]) for one in look["interactions"]),
        folded=True,
    )

"""Which parameters matter: the path of a screening, and what other methods say."""

from collections.abc import Iterable, Mapping
from typing import Any

from workbench.report.lines.statements import regime_text, state_text, variance_text
from workbench.report.lines.tables import fitted, format_number, hanging, table_lines, unit_suffix
from workbench.space.units import counted

__all__ = ["left_out_text", "method_lines", "other_screening_lines", "screening_lines"]


def screening_lines(document: Mapping[str, Any]) -> list[str]:
    """The screening path in the form of Table 3.1 of the dissertation, and what was selected.

    The common theta has a column where there is one: in the default what is not selected has no part.
    """
    shared = any(step["theta_common"] for step in document["path"])
    head = ("step", "selected so far", *(["theta"] * shared), "sigma^2", "restricted log-likelihood")
    accepted = [step for step in document["path"] if step.get("accepted", True)]
    rejected = [step for step in document["path"] if not step.get("accepted", True)]
    rows = [
        (
            str(step["step"]),
            ", ".join(step["selected"]) + ("" if step.get("accepted", True) else "  (not\u00a0accepted)"),
            *([format_number(step["theta_common"], 4)] * shared),
            format_number(step["sigma2"], 5),
            format_number(step["log_likelihood"], 6),
        )
        for step in [*accepted, *rejected[:1]]
    ]
    names = ", ".join(document["selected"]) or "none"
    unit = unit_suffix(document.get("unit", "1")).strip()
    said = state_text(document)
    text = [
        f"Screening of {document['response']}{f' [{unit}]' if unit else ''}: "
        + (f"{said} ({document['method']})" if said else str(document["method"]))
    ]
    text += [f"{mode['sentence']}." for mode in document.get("modes") or ()]
    text += table_lines(head, rows)
    if shared:
        text.append("theta: common range parameter of the variables not selected, on the unit cube")
    if len(rejected) > 1:
        more = len(rejected) - 1
        text.append(f"{more} further step{'s were' if more > 1 else ' was'} tried, none accepted")
    if document.get("scale"):
        text.append(f"screened by {document['scale']}")
    text.append(f"selected: {names}")
    if document.get("minor"):
        text.append(f"acts, below 1 % of {variance_text(document)}: {_listed(document['minor'])}")
    text += regime_text(document)
    text += _parts("", document.get("verdict")) + _parts("to do: ", document.get("advice"))
    kriging = document.get("kriging") or {}
    if kriging.get("calibration") == "cross_validation":
        text.append(
            f"intervals of the screened Kriging: {kriging['interval_factor']:.2f} times the plug-in ones, "
            "by cross-validation"
        )
    if document.get("n_left_out"):
        text.append(left_out_text(document["n_left_out"]))
    return fitted(text)


def other_screening_lines(document: Mapping[str, Any]) -> list[str]:
    """What `holdfast screen --method` found: the path of a method of ours, or rankings of others."""
    return screening_lines(document) if "path" in document else fitted(_ranking_lines(document))


def _ranking_lines(document: Mapping[str, Any]) -> list[str]:
    """Indices, effects, or the rankings of several methods."""
    unit = unit_suffix(document["unit"]).strip()
    lines = [f"Screening of {document['response']}{f' [{unit}]' if unit else ''}: {document['method']}"]
    if document["method"] == "rivals":
        for one in document["rankings"]:
            kept = one["selected"]
            first = one["ranking"][: len(kept) if kept else 6]
            what = "has no rule of its own; first" if kept is None else f"selects {len(kept)}:"
            lines.append(f"  {one['method']:<10} {what} {', '.join(first)}")
        if document.get("scale"):
            lines.append(f"all by {document['scale']}")
        return [*lines, "rankings of different methods are comparable, their scores are not"]
    if "indices" in document:
        return [*lines, *_index_lines(document)]
    lines.append(f"  {document['n_runs']} runs in trajectories, mean absolute effect over the whole range:")
    width = max(len(name) for name in document["ranking"])
    for name in document["ranking"]:
        spread = document["sigma"][name]
        more = "" if spread is None else f", spread {format_number(spread, 4)}"
        lines.append(f"  {name:<{width}}  {format_number(document['mu_star'][name], 4)}{more}")
    if document["n_left_out"]:
        lines.append(f"{document['n_left_out']} runs of trajectories with a failed run were left out")
    if document["method"] == "hybrid":
        lines.append(f"selected with {document['stored_runs']} stored runs: {_listed(document['selected'])}")
        lines.append(f"in one of the two rankings only: {_listed(document['disputed'])}")
        if document.get("scale"):
            lines.append(f"screened by {document['scale']}")
        lines += [str(document[key]) for key in ("verdict", "advice") if document[key]]
    return lines


COLUMNS = {
    "main": ("main", "main_lower", "main_upper"),
    "total": ("total", "total_lower", "total_upper"),
    "coefficient": ("value", "lower", "upper"),
    "R2-HSIC": ("r2_hsic",),
    "p-value": ("p_value",),
}
MOST_INTERACTIONS = 6


def _index_lines(document: Mapping[str, Any]) -> list[str]:
    """A line per parameter, the largest first; then interactions, what it rests on and what it cannot see."""
    width = max(len(name) for name in document["ranking"])
    bands = "" if "r2_hsic" in document["indices"][document["ranking"][0]] else "; in brackets 95 % bands"
    lines = [f"  {document['n_runs']} runs{bands}"]
    for name in document["ranking"]:
        row = document["indices"][name]
        parts = [
            f"{title} {row[first]:.3f}" + (f" [{row[ends[0]]:.3f}, {row[ends[1]]:.3f}]" if ends else "")
            for title, (first, *ends) in COLUMNS.items()
            if first in row
        ]
        lines.append(f"  {name:<{width}}  {'  '.join(parts)}")
    for one in [one for one in document.get("interactions", ()) if one["lower"] > 0.0][:MOST_INTERACTIONS]:
        both = " and ".join(one["pair"])
        lines.append(f"  {both} together: {one['mean']:.3f} [{one['lower']:.3f}, {one['upper']:.3f}]")
    if "q2" in document:
        scale = document.get("scale", "none")
        of = "" if scale == "none" else f" of the response on another scale ({scale}), carried back,"
        lines.append(
            f"of a Kriging ({document['correlation']}, {document['trend']} trend){of} with Q2 "
            f"{document['q2']:.3f}"
        )
    if "r2" in document:
        lines.append(f"the linear regression explains R2 {document['r2']:.3f}")
    if document["left_out"]:
        lines.append(f"labels without an order are left out: {_listed(document['left_out'])}")
    if document.get("n_left_out"):
        lines.append(left_out_text(document["n_left_out"]))
    return [*lines, f"cannot see: {document['cannot_see']}"]


def method_lines(methods: Iterable[Any]) -> list[str]:
    """Every way to look at which parameters matter: what it gives, needs and cannot see."""
    lines = []
    for one in methods:
        lines += hanging(f"{one.name:<8} ", one.gives, indent=9)
        for part in (f"needs {one.needs}", f"cannot see {one.cannot_see}"):
            lines += hanging(" " * 9, part, indent=11)
    return lines


def _parts(title: str, said: str | None) -> list[str]:
    """A sentence of several parts, a line for each.

    >>> _parts("to do: ", "add about 12 runs; put them where grip is above 0.4")
    ['to do: add about 12 runs', '  put them where grip is above 0.4']
    """
    if not said:
        return []
    first, *others = said.split("; ")
    return [title + first, *(f"  {other}" for other in others)]


def _listed(names: list[str]) -> str:
    return ", ".join(names) or "none"


def left_out_text(count: int) -> str:
    """That runs without a value were left out."""
    return f"{counted(count, 'run')} without a value {'was' if count == 1 else 'were'} left out"

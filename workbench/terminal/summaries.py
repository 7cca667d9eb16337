"""What the stages found, in words and tables of 80 columns."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "comparison_lines",
    "design_lines",
    "format_number",
    "layout_lines",
    "limits_text",
    "quantile_text",
    "robust_layout_lines",
    "robust_lines",
    "run_lines",
    "screening_lines",
    "table_lines",
    "unit_suffix",
    "worst_case_lines",
]

QUALITIES = ("min_distance", "cd2", "max_correlation", "d_efficiency")


def format_number(value: float | None, digits: int = 5) -> str:
    """A number for a person: significant digits, "-" for none.

    >>> format_number(-50.16789), format_number(0.0000123), format_number(None)
    ('-50.168', '1.23e-05', '-')
    """
    return "-" if value is None else f"{value:.{digits}g}"


def design_lines(document: Mapping[str, Any], *, whole: bool = False) -> list[str]:
    """How good the design is, each measure beside random Latin hypercubes of the same size; some, or all."""
    quality = document.get("quality") or {}
    rows = []
    for name in quality if whole else QUALITIES:
        entry = quality.get(name)
        if entry is None or entry["value"] is None or entry["percentile"] is None:
            continue
        beaten = entry["percentile"] if entry["better"] == "high" else 100 - entry["percentile"]
        rows.append((name.replace("_", " "), f"better than {beaten:.0f} %", format_number(entry["value"], 4)))
    if not rows:
        return []
    return table_lines(("design quality", "of random Latin hypercubes", "value"), rows)


def comparison_lines(frame: "pd.DataFrame") -> list[str]:
    """The table of `workbench.compare`: value, and share of random Latin hypercubes beaten, per design."""
    designs = list(dict.fromkeys(frame.columns.get_level_values(0)))
    rows = []
    for metric, row in frame.iterrows():
        cells = [str(metric).replace("_", " ")]
        for name in designs:
            value, beaten = row[name, "value"], row[name, "better than"]
            share = "" if math.isnan(beaten) else f" ({beaten:.0f} %)"
            cells.append(
                "-" if value is None or math.isnan(value) else format_number(float(value), 4) + share
            )
        rows.append(tuple(cells))
    lines = table_lines(("design quality", *designs), rows)
    return [*lines, "in brackets: share of random Latin hypercubes that the design is better than"]


def screening_lines(document: Mapping[str, Any]) -> list[str]:
    """The screening path in the form of Table 3.1 of the dissertation, and what was selected."""
    head = ("step", "selected so far", "theta", "sigma^2", "restricted log-likelihood")
    accepted = [step for step in document["path"] if step.get("accepted", True)]
    rejected = [step for step in document["path"] if not step.get("accepted", True)]
    rows = [
        (
            str(step["step"]),
            ", ".join(step["selected"]) + ("" if step.get("accepted", True) else "  (not\u00a0accepted)"),
            format_number(step["theta_common"], 4),
            format_number(step["sigma2"], 5),
            format_number(step["log_likelihood"], 6),
        )
        for step in [*accepted, *rejected[:1]]
    ]
    names = ", ".join(document["selected"]) or "none"
    unit = unit_suffix(document.get("unit", "1")).strip()
    text = [f"Screening of {document['response']}{f' [{unit}]' if unit else ''}: {document['method']}"]
    text += table_lines(head, rows)
    if any(step["theta_common"] for step in document["path"]):
        text.append("theta: common range parameter of the variables not selected, on the unit cube")
    else:
        text.append("theta: of the variables not selected, 0 in this method: they have no part in the model")
    if len(rejected) > 1:
        text.append(f"{len(rejected) - 1} further steps were tried, none accepted")
    text.append(f"selected: {names}")
    text += [str(document[key]) for key in ("verdict", "advice") if document.get(key)]
    kriging = document.get("kriging") or {}
    if kriging.get("calibration") == "cross_validation":
        text.append(
            f"intervals of the screened Kriging: {kriging['interval_factor']:.2f} times the plug-in ones, "
            "by cross-validation"
        )
    if document.get("n_left_out"):
        text.append(f"{document['n_left_out']} runs without a value were left out")
    return text


def worst_case_lines(document: Mapping[str, Any]) -> list[str]:
    """The worst case, what it rests on, and what remains open; then those of other responses."""
    lines = _one_worst_case(document)
    for other in document.get("others") or ():
        lines += ["", *_one_worst_case(other)]
    return lines


def limits_text(limits: Mapping[str, Sequence[float | None]]) -> str:
    """What keeps to its limits, as a person says it.

    >>> limits_text({"travel": [None, 0.6], "load": [1.0, 2.0]})
    'travel <= 0.6 and 1 <= load <= 2'
    """
    parts = []
    for name, (low, high) in limits.items():
        left = "" if low is None else f"{format_number(low)} <= "
        parts.append(left + name + ("" if high is None else f" <= {format_number(high)}"))
    return " and ".join(parts)


def quantile_text(quantile: Mapping[str, Any]) -> str:
    """What is exceeded with a small chance only, in a sentence without its full stop."""
    unit = unit_suffix(quantile["unit"])
    side = "above" if quantile["sense"] == "max" else "below"
    return (
        f"in {100 * (1 - quantile['share']):.3g} % of all cases {quantile['response']} lies {side} "
        f"{format_number(quantile['value'])}{unit} (between {format_number(quantile['lower'])} and "
        f"{format_number(quantile['upper'])}{unit}, by the Kriging of "
        f"{quantile['known'] + quantile['evaluations']} runs)"
    )


def _one_worst_case(document: Mapping[str, Any]) -> list[str]:
    unit = unit_suffix(document["unit"])
    word = {"max": "largest", "min": "smallest"}[document["sense"]]
    text = [f"Worst case ({word} {document['response']}): {format_number(document['value'], 6)}{unit}"]
    if document.get("within"):
        text.append(f"  of the runs with {limits_text(document['within'])}")
    runs = f"; {document['evaluations']} runs of at most {document['budget']}" if document["budget"] else ""
    text.append(f"  {document['label']}{runs}")
    if document.get("status"):
        text.append(f"  stopped because {document['status']}")
    gap = document.get("gap") or {}
    if gap.get("upper") is not None:
        what = "model-based bound, not a proof" if gap["kind"] == "model-based" else gap["kind"]
        text.append(f"  could be as far as {format_number(gap['upper'], 6)}{unit} ({what})")
    if gap.get("failed"):
        text += _wrapped(f"  every point was run; {gap['failed']} failed and may be worse", 79)
    if gap.get("note"):
        text += _wrapped(f"  note: {gap['note']}", 79)
    if document.get("quantile"):
        text += [f"  {line}" for line in _wrapped(quantile_text(document["quantile"]), 77)]
    failures = document.get("failures") or {}
    if failures:
        text.append("  runs without a value: " + ", ".join(f"{n} {status}" for status, n in failures.items()))
    width = max(len(name) for name in document["parameters"])
    text += [f"  {name:<{width}} = {_value(value)}" for name, value in document["parameters"].items()]
    return text


def run_lines(found: Mapping[str, Any]) -> list[str]:
    """What all stages of a study found, and where the report is."""
    text = design_lines(found["design"]) if "design" in found else []
    for stage, lines in (
        ("screen", screening_lines),
        ("worst_case", worst_case_lines),
        ("layout", layout_lines),
        ("robust", robust_lines),
        ("robust_layout", robust_layout_lines),
    ):
        if stage in found:
            text += ["", *lines(found[stage])]
    return [*text, "", f"report: {found['report']}"]


def layout_lines(document: Mapping[str, Any]) -> list[str]:
    """The layout found and what to judge it by."""
    unit = unit_suffix(document["unit"])
    start, value = format_number(document["start_value"], 6), format_number(document["value"], 6)
    text = [
        f"Layout of {document['title'] or document['problem']}: {document['response']} "
        f"{start} -> {value}{unit}"
    ]
    text.append(f"  {document['evaluations']} evaluations by {document['method']}: {document['status']}")
    for budget in document["budgets"]:
        price = format_number(document["shadow_prices"].get(budget["name"]), 4)
        used, limit = format_number(budget["used"]), format_number(budget["limit"])
        text.append(f"  {budget['name']}: {used} of {limit} used, shadow price {price}")
    if document.get("purified"):
        loss = document["purified"]["loss"]
        value = format_number(document["purified"].get("value"), 6)
        text.append(f"  with few fractional members: {value}{unit}"
                    f" (loss {format_number(loss, 3)})")  # fmt: skip
    return text


def robust_lines(document: Mapping[str, Any]) -> list[str]:
    """The designs beside each other, and what the failures among their runs leave open."""
    unit = unit_suffix(document["unit"]).strip()
    rows = []
    for s in document["summaries"]:
        beyond = s["beyond_limit"]
        share = "-" if beyond is None else f"{100 * beyond[0]:.3g} %"
        cells = (s["mean"], s["quantiles"]["P95"][0], s["worst"], s["largest_regret"])
        rows.append(("", s["design"], *(format_number(v) for v in cells), share, str(s["failed"])))
    head = ("", "design", "mean", "P95", "worst met", "most regret", "beyond", "failed")
    text = [f"{document['samples']} points of the uncertainty{f', {unit}' if unit else ''}"]
    text += [line.removeprefix("  ") for line in table_lines(head, rows)]  # long names wrap in second cells
    for name, (mean, low, high) in document["paired"].items():
        interval = f"(95 %: {format_number(low)} to {format_number(high)})"
        text += _wrapped(f"{name}: {format_number(mean)} {interval}", 79)
    priced = [s for s in document["summaries"] if s.get("price_of_robustness") is not None]
    if len(priced) > 1:  # one design has nothing to pay for
        prices = [
            f"{s['design']} {format_number(s['nominal'])} ({format_number(s['price_of_robustness'])})"
            for s in priced
        ]
        text += _wrapped(f"at nominal (price of robustness): {', '.join(prices)}", 79)
    inadmissible = document.get("inadmissible") or {}
    if any(inadmissible.values()):
        each = ", ".join(f"{name} {count}" for name, count in inadmissible.items())
        text += _wrapped(f"points that break a constraint, run for no design: {each}", 79)
    if left_out := document.get("left_out"):
        text += _wrapped(
            f"left out for every design: {left_out} of {document['drawn']} points, in which a run gave no "
            "value",
            79,
        )
        text += [line for s in document["summaries"] for line in _failed_lines(s, document)]
    for warning in document.get("warnings") or ():
        text += _wrapped(f"note: {warning}".replace(" %", "\u00a0%"), 79)
    return text


def _failed_lines(summary: Mapping[str, Any], document: Mapping[str, Any]) -> list[str]:
    part, low, high = (100 * v for v in summary["failed_share"])
    text = f"{summary['design']} failed in {part:.3g} % (95 %: {low:.3g} to {high:.3g} %)"
    risk = summary.get("beyond_or_failed")
    if risk is not None:
        text += f"; failed or beyond {format_number(document['limit'])}: {100 * risk[0]:.3g} %"
    return [f"  {line}" for line in _wrapped(text.replace(" %", "\u00a0%"), 77)]


def robust_layout_lines(document: Mapping[str, Any]) -> list[str]:
    """Rounds of the loop, and the layouts beside each other."""
    unit = unit_suffix(document["unit"])
    text = [f"Robust layout of {document['title']}: worst {document['response']} by true runs"]
    head = ("round", "", "cases", "bound", "worst found", "gap")
    rows = [
        (
            str(k + 1), "", str(r["cases"]), format_number(r["bound"]), format_number(r["worst"]),
            f"{100 * r['gap']:.3g} %",
        )
        for k, r in enumerate(document["rounds"])
    ]  # fmt: skip
    text += table_lines(head, rows)
    text += _wrapped(document["status"], 79)
    beside = [
        (name, "", format_number(kept["worst"]), format_number(kept["nominal"]), str(kept["runs"]))
        for name, kept in document["layouts"].items()
    ]
    text += ["", *table_lines(("layout", "", f"worst{unit}", f"at nominal{unit}", "runs"), beside)]
    for variant in document["variants"]:
        worst = variant.get("failure") or f"worst {format_number(variant['worst'])}{unit}"
        text.append(f"  {variant['name']}: {worst}")
    return text


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]], *, width: int = 79) -> list[str]:
    """A table of at most `width` columns; a long second cell continues below itself."""
    others = sum(max(len(r[k]) for r in (head, *rows)) + 2 for k in range(len(head)) if k != 1)
    room = max(width - others, 14)
    wrapped = [[[r[0]], _wrapped(r[1], room), *([c] for c in r[2:])] for r in (head, *rows)]
    sizes = [max(len(line) for r in wrapped for line in r[k]) for k in range(len(head))]
    text = []
    for n, row in enumerate(wrapped):
        for line in range(max(map(len, row))):
            cells = [cell[line] if line < len(cell) else "" for cell in row]
            text.append(
                "  ".join(
                    f"{c:<{s}}" if k < 2 else f"{c:>{s}}"
                    for k, (c, s) in enumerate(zip(cells, sizes, strict=True))
                ).rstrip()
            )
        if n == 0:
            text.append("  ".join("-" * s for s in sizes))
    return text


def _wrapped(text: str, width: int) -> list[str]:
    lines = textwrap.wrap(text, width, break_long_words=False) or [""]
    return [line.replace("\u00a0", " ") for line in lines]


def _value(value: Any) -> str:
    return (
        format_number(value, 6)
        if isinstance(value, int | float) and not isinstance(value, bool)
        else str(value)
    )


def unit_suffix(unit: str) -> str:
    """The unit behind a number; nothing for 1."""
    return "" if unit == "1" else f" {unit}"

"""How the stated gap shrank while the search ran."""

from collections.abc import Mapping
from typing import Any

from workbench.figures.worst_case import plot_gap_share, plot_gap_to_bound
from workbench.report.page.blocks import (
    Column,
    Figure,
    Panel,
    Table,
    percent,
    quantity,
)

__all__ = ["gap_figure"]

FEWEST_LOOKS = 2
ROUNDING = 1e-9  # of the bound


def gap_figure(
    worst: Mapping[str, Any], history: list[dict[str, Any]], response: str, unit: str
) -> Figure | None:
    """Worst so far and stated bound over the runs, and what lies between; None when it was stated once."""
    looks: list[Mapping[str, Any]] = list(worst.get("gap_history") or [])
    if len(looks) < FEWEST_LOOKS:
        return None
    first, last = looks[0], looks[-1]
    read_off = (
        "What lies between the worst so far and the bound was not excluded by then. A gap that has long "
        "stopped shrinking says that more runs will hardly close it."
    )
    if not all(look["full"] for look in looks):
        read_off += (
            " Open dots are quick looks, which the search takes before every batch. They leave out the rough "
            "model, so a filled dot, the full bound that the report states, may lie higher."
        )
    read_off += _kept(worst, looks, history)
    title = "How the remaining gap went"
    return Figure(
        id="gap-history",
        title=title,
        alt=f"Worst {response} so far and its stated bound over the runs; the gap went from "
        f"{quantity(first['width'], unit, 4)} after {first['runs']} runs to "
        f"{quantity(last['width'], unit, 4)}{_of_range(last)} after {last['runs']}.{_withdrawn(worst)}",
        read_off=read_off,
        panels=(
            Panel(
                draw=lambda ax: plot_gap_to_bound(looks, history=history, label=response, unit=unit, ax=ax),
                width=4.0,
                height=3.0,
            ),
            Panel(draw=lambda ax: plot_gap_share(looks, ax=ax), width=4.0, height=3.0),
        ),
        table=Table(
            id="gap-history",
            title=title,
            columns=(
                Column(name="runs known"),
                Column(name="runs of the search"),
                Column(name="bound", unit=unit),
                Column(name="gap", unit=unit),
                Column(name="share of the range seen", unit="%"),
                Column(name="kind"),
                Column(name="look"),
            ),
            rows=tuple(
                (
                    look["runs"],
                    look["iteration"],
                    look["upper"],
                    look["width"],
                    None if look["share"] is None else 100.0 * look["share"],
                    look["kind"],
                    "full" if look["full"] else "quick",
                )
                for look in looks
            ),
        ),
    )


def _kept(worst: Mapping[str, Any], looks: list[Mapping[str, Any]], history: list[dict[str, Any]]) -> str:
    """How many of the bounds a later run of the search went beyond, and whether the last one still stands."""
    sign = 1.0 if worst["sense"] == "max" else -1.0
    broken, later = 0, 0
    for look in looks:
        values = [sign * run["value"] for run in history[look["runs"] :] if run["value"] is not None]
        later += bool(values)
        broken += bool(values) and max(values) > sign * look["upper"] + ROUNDING * abs(look["upper"])
    how = "none of them was exceeded" if not broken else f"{broken} of them did not hold"
    said = f" Runs followed on {later} of the {len(looks)} bounds; {how}." if later else ""
    return said + _withdrawn(worst)


def _withdrawn(worst: Mapping[str, Any]) -> str:
    """That the search ended without a bound, whatever it stated on the way; "" where it states one."""
    if (worst.get("gap") or {}).get("upper") is not None:
        return ""
    return " In the end no bound is stated."


def _of_range(look: Mapping[str, Any]) -> str:
    share = look["share"]
    return "" if share is None else f" ({percent(share, 1)} of the range seen)"

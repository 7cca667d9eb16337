"""Main effects of the selected parameters, with bands, on one common response axis."""

from collections.abc import Mapping
from typing import Any

from workbench.figures.screening import plot_main_effect
from workbench.report.page.blocks import (
    Column,
    Figure,
    Note,
    Panel,
    Section,
    Table,
    names_of,
    number,
)
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.fit import trust_in

__all__ = ["effects_section"]

MARGIN = 0.05


def effects_section(folder: CampaignFolder) -> Section | None:
    """None without main effects."""
    screening = folder["screening"]
    effects = None if screening is None else screening.get("main_effects")
    if screening is None or not effects:
        return None
    names = [name for name in screening["ranking"] if name in effects]
    swing = {name: max(effects[name]["mean"]) - min(effects[name]["mean"]) for name in names}
    response, unit = str(screening["response"]), str(screening.get("unit") or "1")
    largest = max(names, key=lambda name: swing[name])
    loo = screening.get("leave_one_out")
    trust = trust_in(loo) if loo else None
    sentences = (
        f"By the Kriging, averaged over all other parameters, {largest} moves {response} most: by "
        f"{number(swing[largest])} {'' if unit == '1' else unit}".rstrip()
        + " from its lowest to its highest mean.",
        "A parameter that acts only together with others has a flat line here although it matters.",
        *(() if trust is None else (trust.sentence,)),
    )
    doubt = Note(text="The Kriging predicts poorly here: its effects are a guess.", level="poor")
    low = min(min(effects[name]["lower"]) for name in names)
    high = max(max(effects[name]["upper"]) for name in names)
    pad = MARGIN * (high - low)
    limits = (low - pad, high + pad)
    return Section(
        id="effects",
        title="Main effects",
        sentences=sentences,
        blocks=(
            *((doubt,) if trust is not None and trust.level == "poor" else ()),
            Figure(
                id="main-effects",
                title=f"Mean of {response} along each selected parameter",
                alt=f"Main effects of {names_of(names)} on {response}; the largest swing is {largest}'s with "
                f"{number(swing[largest])}.",
                read_off="All drawings share the vertical axis, so heights compare. The band holds the mean "
                "(not single runs) with 95 % by the Kriging.",
                panels=tuple(_panel(folder, effects[name], name, response, unit, limits) for name in names),
                table=_table(folder, effects, names, response, unit),
            ),
        ),
        numbers={"swing": swing, "response": response, "unit": unit},
    )


def _panel(
    folder: CampaignFolder,
    effect: Mapping[str, Any],
    name: str,
    response: str,
    unit: str,
    limits: tuple[float, float],
) -> Panel:
    def draw(ax: Any) -> Any:
        return plot_main_effect(
            effect,
            name=name,
            unit=folder.unit_of(name),
            response=response,
            response_unit=unit,
            limits=limits,
            ax=ax,
        )

    return Panel(draw=draw, width=3.2, height=2.5)


def _table(
    folder: CampaignFolder, effects: Mapping[str, Any], names: list[str], response: str, unit: str
) -> Table:
    rows = []
    for name in names:
        e = effects[name]
        n = len(e["x"])
        for k in (
            dict.fromkeys(round(i * (n - 1) / min(n - 1, 4)) for i in range(min(n - 1, 4) + 1))
            if n > 1
            else [0]
        ):
            rows.append((name, e["x"][k], folder.unit_of(name), e["mean"][k], e["lower"][k], e["upper"][k]))
    return Table(
        id="main-effects",
        title="Main effects at five places",
        columns=(
            Column(name="parameter"),
            Column(name="at"),
            Column(name="unit"),
            Column(name=f"mean of {response}", unit=unit),
            Column(name="lower", unit=unit),
            Column(name="upper", unit=unit),
        ),
        rows=tuple(rows),
    )

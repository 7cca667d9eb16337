"""The bill of materials: what each member is and bears, and the members in three views with the bodies.

`bill_of_materials.json`:

    members [{member, name, kind, body_a, a, body_b, b, length, density, shares {budget: share},
              tension, compression, stretch, shortening, energy: {value, time, scenario}}]
    left_out {members, shares}     members with next to no density
    bodies [{name, points}], budgets [names], scenarios [names]
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.figures.loop import plot_members
from workbench.report.page.blocks import Block, Column, Figure, Panel, Section, Table, number
from workbench.report.page.folder import CampaignFolder

__all__ = ["bill_section"]

VIEWS = {2: {"front": (0, 1)}, 3: {"side": (0, 2), "top": (0, 1), "front": (1, 2)}}
WIDTH = {2: 6.4, 3: 4.8}  # inches of a view
BORNE = {"tension": "N", "compression": "N", "stretch": "m", "shortening": "m", "energy": "J"}
OPEN = 40  # up to so many members stand open on the page


def bill_section(folder: CampaignFolder) -> Section | None:
    """None without `bill_of_materials.json`, or without members."""
    bill = folder["bill_of_materials"]
    if bill is None or not bill["members"]:
        return None
    members = list(bill["members"])
    blocks: list[Block] = [_views(bill, members), _table(bill, members)]
    return Section(
        id="bill-of-materials", title="The bill of materials", sentences=_sentences(bill, members),
        blocks=tuple(blocks), numbers={"members": len(members), "left_out": bill["left_out"]},
    )  # fmt: skip


def _sentences(bill: Mapping[str, Any], members: list[Mapping[str, Any]]) -> tuple[str, ...]:
    pull = max(members, key=lambda m: max(m["tension"]["value"], m["compression"]["value"]))
    said = [f"{len(members)} members over {_scenarios(len(bill['scenarios']))}."]
    which = "tension" if pull["tension"]["value"] >= pull["compression"]["value"] else "compression"
    force = pull[which]
    said.append(
        f"The largest force is {number(force['value'])} N of {which} in member {pull['name']} at "
        f"{number(force['time'])} s ({force['scenario']})."
    )
    most = max(members, key=lambda m: m["energy"]["value"])
    said.append(f"Member {most['name']} takes up most energy, {number(most['energy']['value'])} J.")
    left = bill["left_out"]
    if left["members"]:
        shares = [f"{100 * share:.2g} % of '{name}'" for name, share in left["shares"].items()]
        uses = f"; together they use {' and '.join(shares)}" if shares else ""
        said.append(f"{left['members']} members with next to no density are left out{uses}.")
    said.append("Forces and elongations are the largest at the time steps of the runs.")
    return tuple(said)


def _scenarios(count: int) -> str:
    return "one scenario" if count == 1 else f"{count} scenarios"


def _views(bill: Mapping[str, Any], members: list[Mapping[str, Any]]) -> Figure:
    dimensions = len(members[0]["a"])
    corners = np.array([p for m in members for p in (m["a"], m["b"])], dtype=float)
    bodies = list(bill["bodies"])
    span = np.ptp(np.vstack([corners, *(np.array(b["points"], dtype=float) for b in bodies)]), axis=0)

    def panel(name: str, axes: tuple[int, int]) -> Panel:
        across, up = axes
        height = 1.0 + (WIDTH[dimensions] - 1.8) * span[up] / max(span[across], 1e-9)
        return Panel(
            draw=lambda ax: plot_members(members, bodies=bodies, axes=axes, ax=ax),
            width=WIDTH[dimensions], height=float(np.clip(height, 2.2, 6.5)),
            title=name if dimensions == 3 else "",
        )  # fmt: skip

    views = VIEWS[dimensions]
    count = "Three views" if dimensions == 3 else "A view"
    return Figure(
        id="bill-views",
        title="The members and the bodies they tie",
        alt=f"{count} of {len(members)} members between {', '.join(str(b['name']) for b in bodies)}.",
        read_off="Thickness is density relative to the largest; a grey shape holds all points of a body "
        "where a member may be tied to it, at the start.",
        panels=tuple(panel(name, axes) for name, axes in views.items()),
        table=Table(
            id="bill-ends", title="Ends of the members",
            columns=(
                Column(name="member"), Column(name="body"), Column(name="from", unit="m"),
                Column(name="other body"), Column(name="to", unit="m"), Column(name="length", unit="m"),
            ),
            rows=tuple(
                (m["name"], m["body_a"], _point(m["a"]), m["body_b"], _point(m["b"]), m["length"])
                for m in members
            ),
        ),
    )  # fmt: skip


def _table(bill: Mapping[str, Any], members: list[Mapping[str, Any]]) -> Table:
    budgets = list(bill["budgets"])
    several = len(bill["scenarios"]) > 1
    columns = [Column(name="member"), Column(name="kind"), Column(name="length", unit="m")]
    columns += [Column(name="density"), *(Column(name=f"share of {name}", unit="%") for name in budgets)]
    rows: list[list[Any]] = [
        [m["name"], m["kind"], m["length"], m["density"], *(100 * m["shares"][name] for name in budgets)]
        for m in members
    ]
    for name, unit in BORNE.items():
        if not any(m[name]["value"] for m in members):
            continue
        columns += [Column(name=f"largest {name}", unit=unit), Column(name=f"{name} at", unit="s")]
        columns += [Column(name=f"{name} in")] if several else []
        for row, m in zip(rows, members, strict=True):
            found = m[name]
            row += [found["value"], found["time"]] if found["value"] else [0.0, None]
            row += [found["scenario"] if found["value"] else None] if several else []
    return Table(
        id="bill-of-materials", title="What each member is and bears", columns=tuple(columns),
        rows=tuple(tuple(row) for row in rows), folded=len(rows) > OPEN,
    )  # fmt: skip


def _point(p: Any) -> str:
    return ", ".join(number(float(v), 4) for v in p)

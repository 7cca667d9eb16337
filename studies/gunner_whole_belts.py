"""At most so many whole belts in severe braking, beside belts in fractions, both under attack.

    python -m studies.gunner_whole_belts [numbers, as 4,8,12] [--rounds N] [--scenarios N] [--attack N]
        [--outsider N] [--seed N]

The gunner of the shipped demonstration with its uncertainty; for every number of belts two layouts are made,
attacked and tried by an outsider (`studies.whole_under_attack`). Whole belts go with their mirror images, and
anchors are counted. The search takes steps of 2 ms; what is told are true runs of the demonstration's step.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.gunner.cabin.facing import HATCH
from studies.gunner.restraints.ground_structure import sites
from studies.gunner.restraints.model import GunnerRestraint, restraint
from studies.whole_under_attack import Counted, Effort, asked_effort, count_members, parser
from workbench.engine.layout.formulation.groups import mirrored
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.whole.spending import Spending
from workbench.space.box import Space
from workbench.study.loading import load_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COUNTS", "Gunner", "count_belts", "curve", "lines", "main"]

Case = Mapping[str, Any]

COUNTS = (4, 8, 12, 20)
SEARCHED = 2e-3  # s: step of the searches


@dataclass(frozen=True, slots=True, kw_only=True)
class Gunner:
    """The gunner of the demonstration, without airbags.    base: his layout model, whatever its budget."""

    space: Space
    nominal: Case
    base: GunnerRestraint

    def model(self, count: int) -> GunnerRestraint:
        """The model with a budget of so many belts."""
        return replace(self.base, limits={"belt": float(count)})

    def searched(self, count: int, cases: Sequence[Case]) -> LayoutProblem:
        """The problem of these cases in steps of 2 ms."""
        return replace(self.model(count), steps=round(self.base.t_end / SEARCHED)).problem(cases)

    def groups(self, problem: LayoutProblem) -> list[list[int]]:
        """Mirror images in the plane of the hatch."""
        assert problem.geometry is not None
        return mirrored(problem.geometry, axis=1, at=float(HATCH[1]))

    def spending(self, problem: LayoutProblem) -> Spending:
        """Anchors on the vehicle are counted."""
        assert problem.geometry is not None
        vehicle = {int(body) for body in np.asarray(problem.geometry.body_b)}
        return Spending(anchor=1.0, bodies=sorted(vehicle))


def count_belts(
    counts: Sequence[int] = COUNTS, *, effort: Effort | None = None, model: GunnerRestraint | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> list[Counted]:  # fmt: skip
    """Layouts of so many whole belts and of fractions, attacked.

    model: without airbags; None for that of the demonstration. tell: called with what is being done.
    """
    study = load_study(str(files("studies.gunner.restraints") / "restraint_demo.toml"))
    assert study.robust_layout is not None
    nominal = study.space.canonical(study.robust_layout["nominal"])
    gunner = Gunner(space=study.space, nominal=nominal, base=model or restraint(airbags=0.0))
    return count_members(gunner, counts, effort=effort, tell=tell)


def lines(found: Counted) -> list[str]:
    """A row of the table, and which belts they are."""
    belts = [site for site, a in zip(sites(), found.whole_density, strict=False) if a > 0.5]
    which = ", ".join(f"{s.side} {s.segment.split()[0]} layer {s.layer} (no. {s.number})" for s in belts)
    return [
        f"{found.count:3d} belts  spread evenly {found.uniform:.4f}  in fractions {found.fractions:.4f}  "
        f"whole {found.whole:.4f} m  price {100 * found.price:.1f} %  "
        f"{len(belts)} on, {found.anchors} anchors  outsider beyond "
        f"{100 * found.beyond[0]:.1f}, {100 * found.beyond[1]:.1f} %  {found.status}",
        f"    {which}",
    ]


def curve(found: Sequence[Counted]) -> "Figure":
    """Worst deviation by number of belts."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    ax = figure.subplots()
    counts = [one.count for one in found]
    ax.plot(counts, [one.uniform for one in found], "0.6", marker="^", label="spread evenly")
    ax.plot(counts, [one.fractions for one in found], "C0", marker="o", label="in fractions")
    ax.plot(counts, [one.whole for one in found], "C1", marker="s", label="whole, in mirror images")
    ax.set(xlabel="belts, at most", ylabel="worst deviation after attack, m", xticks=counts)
    ax.set_ylim(bottom=0.0)
    ax.legend(fontsize=8)
    return figure


def main() -> None:
    """Print the table and save the curve."""
    purpose = (__doc__ or "").splitlines()[0]
    ask = parser("studies.gunner_whole_belts", purpose, counts=COUNTS, effort=Effort())
    ask.add_argument("--folder", type=Path, default=Path(), help="where the curve is drawn")
    given = ask.parse_args()
    effort = asked_effort(given, Effort())
    found = count_belts(given.counts, effort=effort, tell=lambda text: print(text, flush=True))
    for one in found:
        print("\n".join(lines(one)), flush=True)
    curve(found).savefig(given.folder / "gunner_whole_belts.png", dpi=100)


if __name__ == "__main__":
    main()

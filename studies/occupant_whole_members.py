"""At most so many whole belts and airbags for the planar occupant, beside fractions, both under attack.

    python -m studies.occupant_whole_members [numbers, as 8,12] [--rounds N] [--scenarios N] [--attack N]
        [--outsider N] [--seed N]

The occupant of the shipped demonstration with its uncertainty, one budget for belts and airbags together; for
every number two layouts are made, attacked and tried by an outsider (`studies.whole_under_attack`). The
search takes steps of 8 ms; what is told are true runs of 2 ms.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from studies.occupant_braking import OccupantRestraint, restraint
from studies.whole_under_attack import Counted, Effort, asked_effort, count_members, parser
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.space.box import Space
from workbench.study.loading import load_study

__all__ = ["COUNTS", "Occupant", "count_restraints", "line", "main"]

Case = Mapping[str, Any]

COUNTS = (12,)
SEARCHED = 250  # steps of the two seconds in the searches
EFFORT = Effort(
    scenarios=50, fractions=40, whole=300, rounds=8, attack=400, outsider=3000, joining=12, seed=1
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Occupant:
    """The occupant of the demonstration with one budget for belts and airbags."""

    space: Space
    nominal: Case

    def model(self, count: int) -> OccupantRestraint:
        """The model with a budget of so many members in all, belts or airbags."""
        return restraint(belts=count / 2, airbags=count / 2, budget="shared")

    def searched(self, count: int, cases: Sequence[Case]) -> LayoutProblem:
        """The problem of these cases in steps of 8 ms."""
        return restraint(belts=count / 2, airbags=count / 2, budget="shared", steps=SEARCHED).problem(cases)

    def groups(self, problem: LayoutProblem) -> list[list[int]]:
        """None: each is on or off by itself."""
        return []

    def spending(self, problem: LayoutProblem) -> None:
        """Anchors are not counted: places differ by kind alone."""
        return None


def count_restraints(
    counts: Sequence[int] = COUNTS, *, effort: Effort = EFFORT,
    tell: Callable[[str], None] = lambda text: None,
) -> list[Counted]:  # fmt: skip
    """Layouts of so many whole members and of fractions, attacked.

    tell: called with what is being done.
    """
    study = load_study(str(files("studies") / "occupant_demo.toml"))
    assert study.robust_layout is not None
    nominal = study.space.canonical(study.robust_layout["nominal"])
    return count_members(Occupant(space=study.space, nominal=nominal), counts, effort=effort, tell=tell)


def line(found: Counted) -> str:
    """A row of the table."""
    return (
        f"{found.count:3d} members  spread evenly {found.uniform:.4f}  in fractions {found.fractions:.4f}  "
        f"whole {found.whole:.4f} m  price {100 * found.price:.1f} %  {found.rounds} rounds  outsider beyond "
        f"{100 * found.beyond[0]:.1f}, {100 * found.beyond[1]:.1f} %  {found.status}"
    )


def main() -> None:
    """Print what is done, and a row for each number."""
    purpose = (__doc__ or "").splitlines()[0]
    given = parser("studies.occupant_whole_members", purpose, counts=COUNTS, effort=EFFORT).parse_args()
    effort = asked_effort(given, EFFORT)
    for one in count_restraints(given.counts, effort=effort, tell=lambda text: print(text, flush=True)):
        print(line(one), flush=True)


if __name__ == "__main__":
    main()

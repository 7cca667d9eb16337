"""The ground of a comparison: which points of the uncertainty every design may meet.

A constraint on uncertain parameters alone belongs to the uncertainty. One that ties them to the design, such
as "k + f <= 3", is checked with the values of every design: a point that one design cannot meet is no ground
for a comparison, so it is left out for all of them and counted as inadmissible. It is not run and not failed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.errors import StudyError
from workbench.space.box import Space
from workbench.space.expression import Condition
from workbench.space.scenarios import scenario_points

__all__ = ["Ground"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """Which points of the uncertainty every design may meet; `conditions` of each design on both names."""

    uncertainty: Space
    designs: Mapping[str, Mapping[str, Any]]
    conditions: Mapping[str, tuple[Condition, ...]]

    @classmethod
    def of(
        cls, uncertainty: Space, designs: Mapping[str, Mapping[str, Any]], constraints: Sequence[str]
    ) -> "Ground":
        """The ground of the designs.

        Raises:
            StudyError: a constraint names what neither the design nor the uncertainty has, or both have.
        """
        if isinstance(constraints, str):
            raise StudyError(f"constraints needs a list of conditions, got a text; write [{constraints!r}]")
        conditions = {}
        for name, values in designs.items():
            twice = sorted(set(values) & set(uncertainty.names)) if constraints else []
            if twice:
                raise StudyError(
                    f"design {name!r} sets {twice[0]!r}, which is uncertain, too, so that constraints cannot "
                    "tell which is meant; rename one of them"
                )
            names = (*values, *uncertainty.names)
            try:
                conditions[name] = tuple(Condition(text, names=names) for text in constraints)
            except StudyError as exc:
                raise StudyError(f"with design {name!r}, {exc}") from None
        return cls(uncertainty=uncertainty, designs=designs, conditions=conditions)

    def broken(self, row: Mapping[str, Any]) -> dict[str, str]:
        """Design -> the first constraint that it breaks at this point of the uncertainty."""
        always = self.uncertainty.violated(row)
        if always is not None:
            return dict.fromkeys(self.designs, always)
        found = {
            name: next((c.text for c in self.conditions[name] if not c.holds({**values, **row})), None)
            for name, values in self.designs.items()
        }
        return {name: text for name, text in found.items() if text is not None}

    def check(self, scenarios: Sequence[Mapping[str, Any]], nominal: Mapping[str, Any] | None) -> None:
        """Refuse given points that lie outside the uncertainty or break a constraint, with the reason."""
        scenario_points(self.uncertainty, scenarios)
        for k, row in enumerate(scenarios, start=1):
            self._refuse_broken(f"scenario {k} of {len(scenarios)}", row)
        if nominal is not None:
            try:
                self.uncertainty.unit([nominal])
            except StudyError as exc:
                raise StudyError(f"the nominal scenario is not in the uncertainty: {exc}") from None
            self._refuse_broken("the nominal scenario", nominal)

    def _refuse_broken(self, what: str, row: Mapping[str, Any]) -> None:
        for name, text in self.broken(row).items():
            raise StudyError(
                f"{what} breaks the constraint {text!r} with design {name!r}; give one that all designs meet"
            )

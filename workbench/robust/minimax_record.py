"""What a minimax search found: its cycles with their bounds, the design, its worst scenario, its failures."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import Enum
from math import isfinite
from typing import Any

from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.failure_map import LevelFailures, failure_places
from workbench.search.evidence.gap import COVERAGE, Gap
from workbench.search.evidence.grade import Grade, grade_of
from workbench.space.units import counted

__all__ = ["ALLOWED_ERROR", "Cycle", "FailedRun", "Minimax", "MinimaxStatus"]

ALLOWED_ERROR = 2.0  # standard deviations of the Kriging, in favour of designs that were not run


class MinimaxStatus(Enum):
    """Why the search stopped."""

    CONVERGED = "predicted and true worst case met within the tolerance, and an attack found nothing worse"
    MET = (
        "predicted and true worst case met within the tolerance; no attack that counts has left them standing"
    )
    OPENED = "predicted and true worst case had met; what an attack found left them further apart than that"
    BEATEN = "an attack found a worse scenario than the search knew"
    BUDGET = "the budget of runs was spent"
    EXHAUSTED = "every point of design and uncertainty was run"
    SETTLED = "no new run was left to propose"
    UNMODELLED = "no Kriging could be fitted to the runs"


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedRun:
    """A run without a value. `status`: failed, timeout, killed or nonfinite; excluded where the reading of
    the response left it out."""

    design: Mapping[str, Any]
    scenario: Mapping[str, Any]
    status: str
    error: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One cycle: bounds after `evaluations` runs. `lower` is the master's value on the Kriging (model-based),
    `upper` the worst true run at this cycle's design, `best` the lowest upper bound so far; both are inf
    while every run that they could be read from failed."""

    number: int
    evaluations: int
    lower: float
    upper: float
    best: float
    box: float
    design: Mapping[str, Any]
    scenario: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Minimax:
    """The design with the lowest worst run, its worst scenario, and all cycles.

    `value` is a true run, but that no scenario is worse is the word of the Kriging. So is what other designs
    reach: `predicted`, the master's value of the last cycle, and `lower`, the same where the Kriging errs by
    ALLOWED_ERROR standard deviations in their favour. Both hold for the `part` of the designs that the last
    cycle looked at, the whole where bounds met: lowest and highest value of every parameter with an order.
    Scenarios in which a design cannot be run do not count: `failed` holds all runs without a value,
    `failed_here` those of the returned design. `failure_map` counts them by level of the unordered
    parameters.
    """

    design: Mapping[str, Any]
    scenario: Mapping[str, Any]
    value: float
    lower: float
    status: MinimaxStatus
    cycles: tuple[Cycle, ...]
    scenarios: tuple[Mapping[str, Any], ...]
    evaluations: int
    budget: int
    seed: int
    predicted: float
    part: Mapping[str, tuple[float, float]]
    failed: tuple[FailedRun, ...] = ()
    failure_map: tuple[LevelFailures, ...] = ()
    note: str = ""  # why no Kriging could be fitted
    attack: Attack | None = None  # on the returned design, the last of them

    @property
    def grade(self) -> Grade:
        """What stands behind the claim that no scenario of the returned design is worse."""
        if self.status is MinimaxStatus.EXHAUSTED:
            return Grade.SEARCHED if self.failed_here else Grade.PROVED
        if self.status is MinimaxStatus.BEATEN or self.levels_without_a_run:
            return Grade.SEARCHED
        return grade_of(Gap(upper=self.value, width=0.0, coverage=COVERAGE, kind="model-based"), self.attack)

    @property
    def gap(self) -> float:
        """Upper minus lower bound at the end; model-based, as the lower bound is. Bounds that have met left
        the predicted value within the tolerance; what the Kriging may err by may be more."""
        return max(self.value - self.lower, 0.0)

    @property
    def failures(self) -> int:
        """Runs without a value."""
        return len(self.failed)

    @property
    def failed_here(self) -> tuple[FailedRun, ...]:
        """The runs without a value at the returned design."""
        return tuple(run for run in self.failed if dict(run.design) == dict(self.design))

    @property
    def levels_without_a_run(self) -> tuple[LevelFailures, ...]:
        """Levels of the uncertainty at which the attack on the returned design met failures only."""
        if self.attack is None:
            return ()
        tried = [(a.outcome.parameters, a.value is not None) for a in self.attack.attempts]

        def is_dark(level: LevelFailures) -> bool:
            here = [gave for row, gave in tried if row[level.parameter] == level.level]
            return bool(here) and not any(here)

        return tuple(level for level in self.failure_map if level.side == "uncertainty" and is_dark(level))

    @property
    def _predicted(self) -> str:
        """What the Kriging says of the design and of all others, which an attack may have refuted."""
        box = self.cycles[-1].box if self.cycles else 1.0
        part = f" in the part that was looked at last, {100 * box:.2g} % of every range,"
        near = "" if box >= 1.0 else part
        others = f"no design{near} gets below {self.lower:.6g}"
        if f"{self.lower:.6g}" != f"{self.predicted:.6g}":
            others += (
                f", where it is given {ALLOWED_ERROR:g} standard deviations to err: "
                f"it predicts {self.predicted:.6g} for the best"
            )
        if self.status is MinimaxStatus.BEATEN:
            return f"The Kriging knew of no worse scenario, which the attack refuted; by it {others}"
        return f"By the Kriging, which may err, no scenario is worse there and {others}"

    @property
    def sentence(self) -> str:
        """The result in words, with what its bounds rest on."""
        text = (
            f"The worst run of the design {_named(self.design)} is {self.value:.6g}, in the scenario "
            f"{_named(self.scenario)}; {self.evaluations} of {self.budget} runs, {self.status.value}. "
            f"{self._predicted}."
        )
        if self.attack is not None:
            text += f" {self.grade.name.capitalize()}: {self.attack.sentence}."
        if self.failed:
            text += (
                f" {counted(self.failures, 'run')} gave no value ({failure_counts(self.failed)}), "
                f"{len(self.failed_here)} of them at this design: scenarios that cannot be run do not count."
            )
            if places := failure_places(self.failure_map):
                text += f" {places}"
            if unseen := self.levels_without_a_run:
                named = ", ".join(f"{level.parameter}={level.level}" for level in unseen)
                text += (
                    f" Nothing is known of {named} at this design: no run of the attack gave a value there."
                )
        return text

    def to_dict(self) -> dict[str, Any]:
        """For a JSON document: bounds of every cycle (None where there is none), failures, and the scenarios,
        to begin another search with."""
        document = {
            **asdict(replace(self, attack=None)),
            "status": self.status.value,
            "gap": self.gap,
            "grade": self.grade.name.lower(),
            "attack": None if self.attack is None else self.attack.to_dict(),
            "failures": self.failures,
            "sentence": self.sentence,
            "scenarios": [dict(scenario) for scenario in self.scenarios],
            "failed": [asdict(run) for run in self.failed],
        }
        document["cycles"] = [_finite(asdict(cycle)) for cycle in self.cycles]
        return _finite(document)


def failure_counts(failed: tuple[FailedRun, ...] | list[FailedRun]) -> str:
    """The failures by message, the three most frequent ones.

    >>> run = FailedRun(design={}, scenario={}, status="failed", error="ValueError: too steep")
    >>> failure_counts([run, run])
    '2 x ValueError: too steep'
    """
    counts = Counter((run.error.splitlines() or [run.status])[0][:80] for run in failed)
    shown = [f"{count} x {text}" for text, count in counts.most_common(3)]
    return "; ".join([*shown, *(["..."] if len(counts) > 3 else [])])


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    """The values, None in place of infinities, which JSON does not have."""
    return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in values.items()}


def _named(values: Mapping[str, Any]) -> str:
    return ", ".join(
        f"{name}={value:.5g}" if isinstance(value, float) else f"{name}={value}"
        for name, value in values.items()
    )

"""What a worst-case search reports: the worst true run, how it was found, how much worse it may still be."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np

from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.audit import Audit
from workbench.search.evidence.baselines import Baseline
from workbench.search.evidence.border import Border
from workbench.search.evidence.gap import Gap
from workbench.search.evidence.gap_history import GapLook
from workbench.search.evidence.grade import BEYOND, FOR_THE_WORD, Grade, grade_of
from workbench.search.runs.ledger import Ledger, Run
from workbench.search.runs.repeats import Mean
from workbench.search.second_look import LOOK
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.scale import UsedScale

__all__ = ["Status", "WorstCase", "profile_of"]

PROFILE_POINTS = 41
UNSEARCHED = (
    "Not searched: without a model to run, all that is known are the runs given and what a Kriging of them "
    "predicts."
)


class Status(Enum):
    """Why the search stopped."""

    CONVERGED = "the model-based gap stayed below the tolerance"
    BUDGET = "the budget of runs was spent"
    EXHAUSTED = "every point of the finite space was run"
    FAILED = "a run failed, which counts as worse than any value"
    NO_POINT = "no point that meets the constraints was found beside those that were run"
    CONSTANT = "every run gave the same value"  # what that may mean is said of the gap
    KNOWN_RUN = "no model to run: the worst of the given runs, beyond which the surrogate predicts nothing"
    SURROGATE = "no model to run: the extreme of the surrogate, unconfirmed"


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstCase:
    """The worst true run found, how it was found, and how much worse it could still be.

    `repeated`: where runs have noise, the mean of the runs that were made at the reported point after it was
    chosen; `value` is that mean. `border`: where runs fail, and whether the worst case borders on that.
    `scale`: on which scale the response was modelled, and why. `made_again`: runs of the budget that asked
    whether the model has noise and found none; they are not among `runs`.
    """

    response: str
    unit: str  # "1" until `named` says otherwise
    sense: str
    value: float
    parameters: Mapping[str, Any]
    confirmed: bool
    run_key: str
    predicted: float | None
    predicted_std: float | None
    status: Status
    budget: int
    seed: int
    runs: tuple[Run, ...]
    gap: Gap
    audit: Audit
    profile: Mapping[str, Mapping[str, list[float]]] = field(default_factory=dict)
    baselines: Mapping[str, Baseline] = field(default_factory=dict)
    gap_history: tuple[GapLook, ...] = ()
    attack: Attack | None = None
    repeated: Mean | None = None
    border: Border | None = None
    scale: UsedScale | None = None
    not_attacked: int = 0
    made_again: int = 0

    @property
    def mean(self) -> float | None:
        """The mean at the reported point where runs have noise, None where they have none."""
        return None if self.repeated is None else self.repeated.value

    @property
    def interval(self) -> tuple[float, float] | None:
        """What holds that mean with 95 % confidence."""
        return None if self.repeated is None else self.repeated.interval

    @property
    def grade(self) -> Grade:
        """What stands behind the claim that nothing is worse."""
        return Grade.SEARCHED if not self.confirmed else grade_of(self.gap, self.attack, beyond=BEYOND)

    def named(self, response: str, unit: str) -> "WorstCase":
        """The same under the response's name, and with its unit, which the sentence about the gap carries."""
        return replace(self, response=response, unit=unit, gap=replace(self.gap, unit=unit))

    @property
    def label(self) -> str:
        """How the value was obtained."""
        if self.repeated is not None:
            return self.repeated.label(self.unit)
        return "confirmed by a true run" if self.confirmed else "surrogate only, unconfirmed"

    @property
    def grade_sentence(self) -> str:
        """The grade in words, with the numbers of the attack where there was one."""
        if self.status in (Status.SURROGATE, Status.KNOWN_RUN):
            return UNSEARCHED
        said = self.grade.value if self.attack is None else self.attack.sentence
        missing = (
            f" The attack of {self.not_attacked} runs was not made: the runs have noise, and an adversary "
            "takes each for exact."
            if self.not_attacked
            else ""
        )
        return f"{self.grade.name.capitalize()}: {said}.{self._looked}{self._short_of_attacked}{missing}"

    @property
    def _looked(self) -> str:
        """How many runs a search made where its surrogate did not send it, where nobody else has looked."""
        looked = sum(run.proposal == LOOK for run in self.runs)
        if not looked or self.attack is not None or self.grade is not Grade.SEARCHED:
            return ""
        return f" {looked} of its runs were drawn at random, a second look elsewhere."

    @property
    def _short_of_attacked(self) -> str:
        """What a value lacks that would be called attacked but for the length of the attack."""
        if not self.confirmed or self.grade is not Grade.SEARCHED or self.attack is None:
            return ""
        if grade_of(self.gap, self.attack) is not Grade.ATTACKED:
            return ""
        return (
            f" A value is called attacked where less than {100 * BEYOND:.0f} % of it may lie beyond, which "
            f"takes an attack of about {FOR_THE_WORD} runs."
        )

    @property
    def history(self) -> np.ndarray:
        """True values in the order run, failed runs left out."""
        return np.array([run.value for run in self.runs if run.number and run.value is not None])

    @property
    def evaluations(self) -> int:
        """True runs of this search, failures included."""
        return sum(run.number > 0 for run in self.runs)

    @property
    def failures(self) -> dict[str, int]:
        """Runs without a value, by status."""
        return dict(Counter(run.status for run in self.runs if run.value is None))

    @property
    def _failure(self) -> dict[str, Any] | None:
        """The failed run that is the worst case; beside it the value is the worst that a run gave."""
        border = self.border
        if border is None or not border.is_answer:
            return None
        return {"run_key": border.run_key, "parameters": dict(border.parameters), "words": border.words}

    def to_dict(self) -> dict[str, Any]:
        """The document `worst_case.json`; its value, parameters and run_key belong together."""
        sign = 1.0 if self.sense == "max" else -1.0
        best, history = -np.inf, []
        for run in self.runs:
            counted = run.value if run.smoothed is None else run.smoothed
            best = max(best, sign * counted) if counted is not None else best
            history.append(
                {
                    "run_key": run.key,
                    "iteration": run.number,
                    "proposal": run.proposal,
                    "status": run.status,
                    "value": run.value,
                    "best": sign * best if np.isfinite(best) else None,
                    "predicted": run.predicted,
                    "predicted_std": run.std,
                    "parameters": dict(run.parameters),
                }
            )
        return {
            "response": self.response,
            "unit": self.unit,
            "sense": self.sense,
            "value": self.value,
            "parameters": dict(self.parameters),
            "confirmed": self.confirmed,
            "label": self.label,
            "run_key": self.run_key,
            "predicted": self.predicted,
            "predicted_std": self.predicted_std,
            "status": self.status.value,
            "evaluations": self.evaluations,
            "budget": self.budget,
            "made_again": self.made_again,
            "mean": self.mean,
            "interval": None if self.interval is None else list(self.interval),
            "repeats": None if self.repeated is None else self.repeated.count,
            "noise": None if self.repeated is None else self.repeated.deviation,
            "seed": self.seed,
            "failures": self.failures,
            "failure": self._failure,
            "border": None if self.border is None else self.border.to_dict(),
            "scale": None if self.scale is None else self.scale.to_dict(),
            "history": history,
            "grade": self.grade.name.lower(),
            "grade_sentence": self.grade_sentence,
            "attack": None if self.attack is None else self.attack.to_dict(),
            "gap": self.gap.to_dict(),
            "gap_history": [look.to_dict() for look in self.gap_history],
            "audit": self.audit.to_dict(),
            "profile": {name: dict(band) for name, band in self.profile.items()},
            "baselines": {name: baseline.to_dict() for name, baseline in self.baselines.items()},
        }


def profile_of(ledger: Ledger, model: SearchModel, point: np.ndarray) -> dict[str, dict[str, list[Any]]]:
    """The predicted response along every parameter through `point` (d,), with its 95 % band."""
    where = ledger.where
    out: dict[str, dict[str, list[Any]]] = {}
    for j, (name, grid) in enumerate(zip(where.space.names, where.levels, strict=True)):
        line = np.linspace(0, 1, PROFILE_POINTS) if grid is None or len(grid) > PROFILE_POINTS else grid
        points = np.repeat(point[None], len(line), axis=0)
        points[:, j] = line
        points = where.snap(points)
        mean, std = model.predict(where.features(points))
        low, middle, high = (
            ledger.sign * model.transform.inverse(mean + k * model.inflation * std)
            for k in (-1.96, 0.0, 1.96)
        )
        out[name] = {
            "x": [row[name] for row in where.rows(points)],
            "mean": middle.tolist(),
            "lower": np.minimum(low, high).tolist(),
            "upper": np.maximum(low, high).tolist(),
        }
    return out

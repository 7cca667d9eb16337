"""The runs of a worst-case search in the order they were made, seen as points and signed values."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Evaluator, Outcome, Reading, response_reader
from workbench.models.values import is_value, why_no_values
from workbench.search.runs.given_runs import Run, Start, given_outcomes
from workbench.search.runs.noticeable_gain import accuracy_scale, noticeable_gain, runs_since_gain
from workbench.search.runs.slopes import unit_slope
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.box import Space

__all__ = ["FEWEST_RUNS", "Ledger", "Run", "distinct"]

FEWEST_RUNS = 3
SAME = 1e-12  # relative: values that differ by rounding only
# errors of a program, not of a point: a wrong name of an argument, a missing file or package
MISPROGRAMMED = ("TypeError", "NameError", "AttributeError", "ImportError", "ModuleNotFoundError")


@dataclass(slots=True, kw_only=True)
class Ledger:
    """Runs so far; v = +value or -value is what the search maximises.

    `slopes`: number of the run -> dv/du (d,) in the unit cube, NaN where a coordinate has none. `apart`: runs
    of the search that are kept apart, whose numbers are taken.
    """

    where: SearchSpace
    sign: float
    read: Reading
    response: str | None = None
    is_combination: bool = False
    slopes: dict[int, np.ndarray] = field(default_factory=dict)
    progress: Callable[[Run, float], None] | None = None
    runs: list[Run] = field(default_factory=list)
    apart: int = 0
    # the admissible points of a finite space, None when it cannot be enumerated
    points: np.ndarray | None = None
    _u: list[np.ndarray] = field(default_factory=list)

    @classmethod
    def opened(
        cls,
        space: Space,
        *,
        response: str | Reading | None,
        sense: str,
        start: Start,
        progress: Callable[[Run, float], None] | None,
    ) -> "Ledger":
        """A ledger holding the runs in `start`."""
        where = SearchSpace.of(space)
        ledger = cls(where=where, sign=1.0 if sense == "max" else -1.0, read=response_reader(response))
        ledger.points = where.points()
        ledger.response = None if callable(response) else response
        ledger.is_combination = callable(response)
        given = given_outcomes(start, space, response=response)
        if given:
            rows = [{k: v for k, v in o.parameters.items() if k in space.names} for o in given]
            u = np.empty((len(given), space.dimension))
            for i, (row, outcome) in enumerate(zip(rows, given, strict=True)):
                try:
                    u[i] = space.unit([row])[0]
                except StudyError as exc:
                    raise StudyError(
                        f"run {outcome.key or i + 1} of start is not in the space: {exc}. "
                        "Leave it out or widen the bounds"
                    ) from None
            ledger.add(given, u, proposals=["given"] * len(given), given=True)
        ledger.progress = progress
        return ledger

    def add(
        self,
        outcomes: Sequence[Outcome],
        u: np.ndarray,
        *,
        proposals: Sequence[str],
        predicted: np.ndarray | None = None,
        std: np.ndarray | None = None,
        given: bool = False,
    ) -> None:
        """Append outcomes at the points u (m, d); `predicted` and `std` in the response's unit and sign."""
        for i, (outcome, point) in enumerate(zip(outcomes, u, strict=True)):
            number = 0 if given else self.spent + self.apart + 1
            run = self.run_of(outcome, number=number, proposal=proposals[i])
            if run.status != "excluded" and predicted is not None and std is not None:
                run = replace(run, predicted=float(predicted[i]), std=float(std[i]))
            self.runs.append(run)
            self._u.append(np.asarray(point, dtype=float))
            slope = self._slope(outcome, self._u[-1]) if run.value is not None else None
            if slope is not None:
                self.slopes[len(self.runs) - 1] = slope
            if self.progress is not None:
                self.progress(run, self.best_value)

    def run(
        self,
        evaluate: Evaluator,
        points: np.ndarray,
        *,
        purpose: str,
        predicted: np.ndarray | None = None,
        std: np.ndarray | None = None,
    ) -> None:
        """Run the points (m, d) of one proposal and append them; `predicted` and `std` as for `add`."""
        outcomes = evaluate(self.where.rows(points), purpose=purpose)
        self.add(outcomes, points, proposals=[purpose] * len(points), predicted=predicted, std=std)

    def run_of(self, outcome: Outcome, *, number: int, proposal: str) -> Run:
        """The run of an outcome, as the search reads it."""
        run = Run(
            key=outcome.key,
            number=number,
            proposal=proposal,
            parameters=dict(outcome.parameters),
            status=outcome.status,
            value=self.read(outcome.outputs) if outcome.status == "ok" else None,
            predicted=None,
            std=None,
            outputs=dict(outcome.outputs),
            error=outcome.error if outcome.status != "ok" else "",
        )
        if run.value is not None and not is_value(run.value):
            if not np.isfinite(run.value):  # the outputs are finite: a reading such as `within` leaves it out
                return replace(run, status="excluded", value=None)
            wrong = why_no_values({self.response or "the response": run.value})
            return replace(run, status="nonfinite", value=None, error=wrong)
        return run

    def _slope(self, outcome: Outcome, point: np.ndarray) -> np.ndarray | None:
        """dv/du (d,) of a run that brought the gradient of the searched response; None otherwise."""
        if self.is_combination or not outcome.gradients:
            return None
        response = self.response if self.response is not None else next(iter(outcome.outputs))
        given = outcome.gradients.get(response)
        if given is None:
            return None
        slope = unit_slope(self.where, point, given)
        return None if slope is None else self.sign * slope

    @property
    def spent(self) -> int:
        """True runs of this search."""
        return sum(run.number > 0 for run in self.runs)

    @property
    def u(self) -> np.ndarray:
        """Unit points (n, d) of all runs, failed ones included."""
        return np.array(self._u).reshape(len(self._u), self.where.dimension)

    @property
    def is_exhausted(self) -> bool:
        """Whether every admissible point of a finite space was run."""
        if self.points is None or len(self.points) > len(self.runs):
            return False
        return not len(distinct(self.points, self.u))

    @property
    def ok(self) -> np.ndarray:
        """Which runs gave a value, (n,)."""
        return np.array([run.value is not None for run in self.runs], dtype=bool)

    @property
    def u_ok(self) -> np.ndarray:
        """Unit points of the runs that gave a value."""
        points: np.ndarray = self.u[self.ok]
        return points

    @property
    def incumbent(self) -> np.ndarray:
        """Unit point (d,) of the worst run so far."""
        point: np.ndarray = self.u_ok[int(np.argmax(self.v))]
        return point

    @property
    def v(self) -> np.ndarray:
        """Signed values of the runs that gave one."""
        return self.sign * np.array([run.value for run in self.runs if run.value is not None])

    @property
    def scale(self) -> float:
        """What accuracies are shares of: the spread of the values or the size of the worst one."""
        return accuracy_scale(self.v) if self.ok.any() else 0.0

    @property
    def best(self) -> Run:
        """The worst true run so far."""
        self.require_values(1)
        return max((run for run in self.runs if run.value is not None), key=lambda run: self.sign * run.value)  # type: ignore[operator]

    @property
    def best_value(self) -> float:
        """Its value, NaN before any run succeeded."""
        return float(self.sign * self.v.max()) if self.ok.any() else float("nan")

    @property
    def since_improvement(self) -> int:
        """Runs made since the best value last rose by a noticeable amount."""
        return runs_since_gain(self.v, noticeable_gain(self.v)) if self.ok.any() else 0

    @property
    def is_flat(self) -> bool:
        """Whether several runs gave a value and all gave the same."""
        v = self.v
        return len(v) > 1 and float(np.ptp(v)) <= SAME * float(np.abs(v).max())

    @property
    def is_misprogrammed(self) -> bool:
        """Whether every run failed with one and the same error that is the program's, not the point's."""
        errors = {run.error for run in self.runs}
        return len(errors) == 1 and next(iter(errors)).split(":")[0] in MISPROGRAMMED

    def require_values(self, count: int) -> None:
        """Raise NotEnoughRuns unless `count` runs gave a value."""
        n_ok = int(self.ok.sum())
        if n_ok >= count:
            return
        statuses = dict(Counter(run.status for run in self.runs if run.value is None))
        text = f"{n_ok} of {len(self.runs)} runs gave a value and {count} are needed; runs without a value: "
        text += ", ".join(f"{n} {status}" for status, n in statuses.items())
        errors = Counter(run.error for run in self.runs if run.error)
        if errors:
            text += f"; {_told(errors)}"
        cure = "Mend the model or narrow the space"
        if "excluded" in statuses:
            cure = "Loosen the limits of `within`, which exclude runs"
        raise NotEnoughRuns(f"{text}. {cure}")


def _told(errors: Counter[str]) -> str:
    """The most frequent of the model's errors, how often it came and of how many it is one.

    >>> _told(Counter({"ValueError: no": 3}))
    "the model's error (3 times): ValueError: no"
    >>> _told(Counter(["ValueError: 0.1", "ValueError: 0.2"]))
    "one of the model's 2 errors: ValueError: 0.1"
    """
    error, times = errors.most_common(1)[0]
    often = f" ({times} times)" if times > 1 else ""
    if len(errors) == 1:
        return f"the model's error{often}: {error}"
    which = "the most frequent" if times > 1 else "one"
    return f"{which} of the model's {len(errors)} errors{often}: {error}"


def distinct(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The points (m, d) that are not among the others (n, d), rounding left aside."""
    known = {tuple(np.round(point, 9)) for point in others}
    left: np.ndarray = points[np.array([tuple(np.round(p, 9)) not in known for p in points], dtype=bool)]
    return left

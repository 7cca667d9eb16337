"""The worst case of each of several responses, from one set of runs.

    found = worst_cases(function, space, {"chest": "max", "clearance": "min"}, budget=120)

A run gives all responses, so whatever one search ran is given to the next: the start design is paid once, and
the responses that come later begin with a Kriging of all runs. Each search may spend an equal share of what
is left.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from workbench.errors import StudyError
from workbench.evaluator import Evaluator, Outcome, evaluator_of
from workbench.space import Space
from workbench.worst_case import Progress, WorstCase, search_worst_case

__all__ = ["worst_cases"]


@dataclass(slots=True)
class _Recorder:
    """An evaluator that keeps what it was answered."""

    evaluate: Evaluator
    outcomes: list[Outcome] = field(default_factory=list)

    def __call__(self, rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        answered = self.evaluate(rows, purpose=purpose)
        self.outcomes += answered
        return answered


def worst_cases(
    function: Callable[..., Mapping[str, float]] | None,
    space: Space,
    responses: Mapping[str, str],
    *,
    budget: int = 120,
    seed: int = 0,
    start: Sequence[Outcome | Mapping[str, Any]] = (),
    workers: int = 1,
    tolerance: float = 1e-3,
    evaluator: Evaluator | None = None,
    progress: Callable[[str], Progress] | None = None,
) -> dict[str, WorstCase]:
    """Search the worst case of every response of `function(**parameters)`.

    Args:
        function: returns a mapping of response names to floats.
        responses: name -> "max" or "min", the most important first.
        budget: true runs for all responses together; for the others see `worst_case`.
        evaluator: runs rows and stores them, in place of `function`, which may be None then.
        progress: given the name of a response, what its search calls with every run and the best value.

    Returns: a `WorstCase` by response. Runs made for another response are among its `runs`, with number 0.

    Raises:
        StudyError: no response, and whatever `worst_case` raises.

    >>> from workbench import Parameter
    >>> space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    >>> found = worst_cases(lambda a, b: {"p": a - b, "q": a + b}, space, {"p": "max", "q": "min"}, budget=20)
    >>> found["p"].value, found["q"].value
    (1.0, 0.0)
    """
    if not responses:
        raise StudyError("worst_cases needs at least one response with 'max' or 'min', got none")
    recorder = _Recorder(evaluator_of(function, evaluator))
    found: dict[str, WorstCase] = {}
    for i, (name, sense) in enumerate(responses.items()):
        left = budget - len(recorder.outcomes)
        found[name] = search_worst_case(
            recorder,
            space,
            response=name,
            sense=sense,
            budget=left // (len(responses) - i),
            seed=seed,
            start=[*start, *recorder.outcomes],
            workers=workers,
            tolerance=tolerance,
            progress=None if progress is None else progress(name),
        )
    return found

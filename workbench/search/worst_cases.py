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
from workbench.models.evaluator import Outcome, RepeatingEvaluator, evaluator_of
from workbench.search.arguments import Arguments
from workbench.search.known_runs import with_known_runs
from workbench.search.runs.given_runs import Start, given_rows
from workbench.search.runs.ledger import Ledger
from workbench.search.start import start_size
from workbench.search.worst_case import Progress, WorstCase, search_worst_case
from workbench.space.box import Space

__all__ = ["worst_cases"]


@dataclass(slots=True)
class _Recorder:
    """An evaluator that keeps what it was answered, and looks for all responses in it.

    `outcomes`: what the next search begins with; `known`: these and the runs of attacks.
    """

    evaluate: RepeatingEvaluator
    names: tuple[str, ...]
    outcomes: list[Outcome] = field(default_factory=list)
    known: list[Outcome] = field(default_factory=list)

    def __call__(self, rows: Sequence[Mapping[str, Any]], *, purpose: str, repeat: int = 0) -> list[Outcome]:
        more = {"repeat": repeat} if repeat else {}
        answered = self.evaluate(rows, purpose=purpose, **more)
        for outcome in answered:
            missing = [name for name in self.names if name not in outcome.outputs]
            if outcome.status == "ok" and missing:
                raise StudyError(
                    f"response {missing[0]!r} is not among the model's outputs {sorted(outcome.outputs)}"
                )
        self.known += answered
        if purpose != "attack":  # an attack has a budget of its own, and runs by the thousand fit no Kriging
            self.outcomes += answered
        return answered


def worst_cases(
    function: Callable[..., Mapping[str, float]] | None,
    space: Space,
    responses: Mapping[str, str],
    *,
    budget: int = 120,
    seed: int = 0,
    start: Start = (),
    workers: int = 1,
    tolerance: float = 1e-3,
    attack: int = 0,
    noise: bool | None = None,
    failures: str = "avoid",
    transform: str = "auto",
    evaluator: RepeatingEvaluator | None = None,
    progress: Callable[[str], Progress] | None = None,
) -> dict[str, WorstCase]:
    """Search the worst case of every response of `function(**parameters)`.

    Args:
        function: returns a mapping of response names to floats.
        responses: name -> "max" or "min", the most important first.
        budget: true runs for all responses together; for the others see `worst_case`.
        attack: true runs of the adversary for all responses together, in equal shares. What one search leaves
            of its budget serves the next response, not an attack.
        noise, failures, transform: as for `worst_case`.
        evaluator: runs rows and stores them, in place of `function`, which may be None then.
        progress: given the name of a response, what its search calls with every run and the best value.

    Returns: a `WorstCase` by response. Runs made for another response are among its `runs`, with number 0.

    Raises:
        StudyError: no response, an unknown one or a share of the budget below the start design, and whatever
            `worst_case` raises.

    >>> from workbench import Parameter
    >>> space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    >>> found = worst_cases(lambda a, b: {"p": a - b, "q": a + b}, space, {"p": "max", "q": "min"}, budget=20)
    >>> found["p"].value, found["q"].value
    (1.0, 0.0)
    """
    if not responses:
        raise StudyError("worst_cases needs at least one response with 'max' or 'min', got none")
    if not isinstance(responses, Mapping):
        raise StudyError(
            "responses needs a mapping of names to 'max' or 'min', such as {'y': 'max'}, "
            f"got {responses!r:.60}"
        )
    for sense in responses.values():
        Arguments(sense=sense, budget=budget, seed=seed, workers=workers, tolerance=tolerance)
    given = given_rows(start)
    for name, sense in responses.items():
        ledger = Ledger.opened(space, response=name, sense=sense, start=given, progress=None)
        needed, share = start_size(ledger), budget // len(responses)
        if share < needed:
            raise StudyError(
                f"budget={budget} is shared by {len(responses)} responses, and {share} runs are below the "
                f"start design of {needed}. Raise the budget to at least {len(responses) * (needed + 1)}"
            )
    recorder = _Recorder(evaluator_of(function, evaluator), tuple(responses))
    found: dict[str, WorstCase] = {}
    searched: dict[str, Arguments] = {}
    for i, (name, sense) in enumerate(responses.items()):
        left = budget - len(recorder.outcomes)
        searched[name] = asked = Arguments(
            response=name,
            sense=sense,
            budget=left // (len(responses) - i),
            seed=seed,
            workers=workers,
            tolerance=tolerance,
            attack=attack // len(responses),
            noise=noise,
            failures=failures,
            transform=transform,
            given_are_even=i == 0,
        )
        found[name] = search_worst_case(
            recorder,
            space,
            asked,
            start=[*given, *recorder.outcomes],
            progress=None if progress is None else progress(name),
        )
    # a run made for one response may be the worst known case of another
    return {
        name: with_known_runs(result, space, searched[name], recorder.known) for name, result in found.items()
    }

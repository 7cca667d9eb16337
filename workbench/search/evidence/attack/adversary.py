"""An adversary: given a model and a value, find a case beyond it within a budget of true runs.

    interior     independent cases drawn from the laws of the parameters: of them alone the share of the
                 uncertainty beyond the value is counted
    corner       corners, in equal shares of every combination of unordered levels; all where they fit
    near corner  the same with some coordinates inside
    scouted      cases that were given, run before all others
    change, pair, cliff, pattern, gradient, local    climbs from the claimed case, from other cases known to
                 be bad, and from the worst tops among the drawn cases of each stratum, see
                 `workbench.search.evidence.attack.climbs`
    fine         a climb in short steps from the worst case known
    empty place  cases far from all others, once climbs repeat each other

An adversary shares with the search that it attacks neither a surrogate nor a start design nor a stream of
random numbers; what it runs is a function of its seed, of the budget and of the model's answers. A space
with no more cases than the budget is run whole.

Falsification of simulated systems lives on such attacks (ARCH-COMP, category falsification); how the budget
is split was measured by `studies/adversary.py`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.models.evaluator import Evaluator, Reading, response_reader
from workbench.search.evidence.attack.ascents import BELOW, Arrivals, Ascents
from workbench.search.evidence.attack.record import Attack, Attempt
from workbench.search.evidence.attack.share import counted_share
from workbench.search.evidence.attack.strata import Strata
from workbench.search.evidence.attack.trials import Trials
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.box import Space
from workbench.space.streams import stream

__all__ = ["DEFAULT_SPLIT", "Split", "attack", "runs_since"]

NOTICEABLE = 0.01  # of the value or of the range of the values, the smaller
TRIES = 50  # redraws of an independent case that a constraint refuses


@dataclass(frozen=True, slots=True, kw_only=True)
class Split:
    """Shares of the budget that are drawn at random; the rest climbs."""

    interior: float = 0.25
    corner: float = 0.15
    near_corner: float = 0.10


DEFAULT_SPLIT = Split()


def attack(
    evaluate: Evaluator,
    space: Space,
    *,
    value: float,
    budget: int,
    seed: int,
    sense: str = "max",
    response: str | Reading | None = None,
    split: Split = DEFAULT_SPLIT,
    claimed: Mapping[str, Any] | None = None,
    known: Sequence[tuple[Mapping[str, Any], float]] = (),
    goes_on: bool = False,
    enough: float | None = None,
    scouted: Sequence[Mapping[str, Any]] = (),
) -> Attack:
    """Look for a case beyond `value` over `space` with up to `budget` true runs.

    Args:
        evaluate: runs rows of named parameters, one outcome each; failures are outcomes, see
            `workbench.models.evaluator.Evaluator`. A batch may be run in any order and by any number of
            workers: the cases asked for do not depend on it.
        value: the claim, in the response's own unit and sign: nothing is said to be worse.
        budget: true runs; fewer are made where a finite space has no more.
        seed: of all random numbers of the attack; its stream is no search's.
        response: the name of the attacked response, or a function of the outputs; not needed for one.
        split: what part of the budget is drawn at random.
        claimed: the case at which `value` was found: the first climbs begin there.
        known: bad cases with their values, the claimed one among them where its top may be near: the first
            climbs are local ones from each.
        goes_on: an attack on the same claim has climbed from the claimed case before.
        enough: beyond this value the claim is broken, and no more runs are made once the climbs from known
            cases have ended.

    Raises:
        StudyError: the sense, the value or the budget is of no use, or no case meets the constraints.
    """
    _check(sense=sense, value=value, budget=budget)
    where = SearchSpace.of(space)
    trials = Trials(
        evaluate=evaluate,
        where=where,
        read=response_reader(response),
        response=None if callable(response) else response,
        sign=1.0 if sense == "max" else -1.0,
        budget=budget,
    )
    if scouted:
        trials.run(where.unit(scouted), ["scouted"] * len(scouted))
    every = where.points() if where.size <= budget else None
    rng = stream(seed, "attack")
    strata = Strata.of(where, rng=rng)
    independent: list[float] = []
    arrivals = Arrivals()
    if every is not None:
        trials.run(every, ["enumerated"] * len(every))
    else:
        drawn = _independent(where, round(split.interior * budget), rng)
        if not len(drawn):
            raise StudyError("no case of the space meets its constraints: loosen them or widen the bounds")
        independent = trials.run(drawn, ["interior"] * len(drawn))
        for kind, part, draw in (
            ("corner", split.corner, strata.corners),
            ("near corner", split.near_corner, strata.near_corners),
        ):
            points = draw(round(part * budget), rng)
            trials.run(points, [kind] * len(points))
        starts = [(where.unit([case])[0], trials.sign * at) for case, at in known]
        start = None if claimed is None else (where.unit([claimed])[0], trials.sign * value)
        arrivals = Ascents(
            trials=trials, strata=strata, seed=seed, claimed=start, known=starts, goes_on=goes_on,
            enough=None if enough is None else trials.sign * enough,
            has_all_corners=strata.has_corners_within(round(split.corner * budget)),
        ).run()  # fmt: skip
    return _record(
        trials,
        strata,
        independent,
        value=value,
        sense=sense,
        seed=seed,
        is_exhaustive=every is not None,
        arrivals=arrivals,
    )


def _independent(where: SearchSpace, size: int, rng: np.random.Generator) -> np.ndarray:
    """`size` independent unit points (n, d) of the laws of the parameters, given the constraints."""
    kept = np.empty((0, where.dimension))
    for _ in range(TRIES):
        if len(kept) >= max(size, 1):
            break
        table = where.space.quantile(rng.random((max(size, 1), where.dimension)))
        u = where.space.unit(table)
        kept = np.vstack([kept, u[where.allowed(u)]])
    drawn: np.ndarray = kept[: max(size, 1)]
    return drawn


def _record(
    trials: Trials,
    strata: Strata,
    independent: list[float],
    *,
    value: float,
    sense: str,
    seed: int,
    is_exhaustive: bool,
    arrivals: Arrivals,
) -> Attack:
    sign, values = trials.sign, np.array(trials.values)
    best = int(np.argmax(values)) if np.isfinite(values).any() else None
    drawn = np.array(independent)
    return Attack(
        value=value,
        sense=sense,
        budget=trials.budget,
        seed=seed,
        attempts=tuple(
            Attempt(point=point, kind=kind, value=sign * v if np.isfinite(v) else None, outcome=outcome)
            for point, kind, v, outcome in zip(
                trials.points, trials.kinds, trials.values, trials.outcomes, strict=True
            )
        ),
        largest=None if best is None else float(sign * values[best]),
        parameters=None if best is None else dict(trials.outcomes[best].parameters),
        run_key="" if best is None else trials.outcomes[best].key,
        independent=tuple(sign * v if np.isfinite(v) else None for v in independent),
        since=runs_since(values, trials.kinds, sign * value),
        share=counted_share(int((drawn > sign * value).sum()), len(drawn)),
        failing=counted_share(int((drawn == -np.inf).sum()), len(drawn)),
        strata=len(strata),
        strata_in_all=strata.count,
        is_exhaustive=is_exhaustive,
        climbs=arrivals.begun,
        arrived=arrivals.arrived,
    )


def runs_since(values: np.ndarray, kinds: Sequence[str], claim: float) -> int:
    """Runs after the last of the signed `values` (n,) that was noticeably beyond the claim and all before.

    A climb in short steps that ends a little higher on the same peak tells of no worse place: what it gains,
    up to `BELOW`, is only what later runs must exceed.
    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return len(values)
    scale = min(float(np.ptp(np.append(finite, claim))), max(abs(claim), float(np.abs(finite).max())))
    level, coarse, last = claim, claim, -1  # what has been met, and without climbs in short steps
    for i, (v, kind) in enumerate(zip(values, kinds, strict=True)):
        if kind == "fine" and level < v <= coarse + BELOW * scale:
            level = v
        elif v > level + NOTICEABLE * scale:
            level, coarse, last = v, v, i
    return len(values) - 1 - last


def _check(*, sense: str, value: float, budget: int) -> None:
    if sense not in ("max", "min"):
        raise StudyError(f"sense needs 'max' or 'min', got {sense!r}")
    if not np.isfinite(value):
        raise StudyError(f"an attack needs a finite value to look beyond, got {value!r}")
    if isinstance(budget, bool) or not isinstance(budget, int | np.integer) or budget < 1:
        raise StudyError(f"the budget of an attack needs a whole number of runs >= 1, got {budget!r}")

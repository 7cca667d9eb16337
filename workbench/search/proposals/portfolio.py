"""Which points a worst-case search runs next: a portfolio of proposals in turn.

    ucb          the largest upper confidence bound, half a deviation above the mean: finds corners at once,
                 follows a slope, and keeps off the runs, where a step that gains little teaches little
    predicted    the predicted worst point                            refines, at the end of the budget
    ei           the largest expected improvement                     balances
    cautious     the same under the cautious model                    keeps looking where runs are few
    combination  the largest expected improvement inside the least often run of the discrete combinations
                 whose upper bound exceeds the worst run: none is dropped while it could still hold the worst
    flip         one coordinate of the worst run moved to another level or to its other end
    trust        the predicted worst inside a box around the worst run
    hill         around the top of the next peak (`workbench.search.proposals.other_peaks`), by a model of the
                 runs near it: by turns the largest expected gain over it and the largest confidence bound
    explore      the highest upper bound of the roughest credible model among random points
    border       where runs fail, the largest predicted gain on the feasible side of the failures
                 (`workbench.search.proposals.border_walk`), every fourth time at another place of the border;
                 first in a batch

Whose turn it is says `workbench.search.proposals.turns`. Every proposal is multiplied with the chance that
the run succeeds, and none lies closer than a thousandth of the cube to a run already made. After each point
of a batch the models believe their own prediction there, so that the next one goes where it teaches
something, a twentieth of the cube away at least.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from workbench.search.proposals.best_point import best_point, start_pool
from workbench.search.proposals.border_walk import BORDER, BorderWalk
from workbench.search.proposals.known import Known
from workbench.search.proposals.other_peaks import Peak, next_peak
from workbench.search.proposals.turns import Turn, turns_of
from workbench.search.surrogate.fitting import fit_rough_model
from workbench.search.surrogate.model import SearchModel

__all__ = ["Batch", "predicted_worst", "propose"]

LOCAL = ("ucb", "predicted", "trust", "flip")  # given up where one deviation holds no noticeable gain
SOUGHT = ("ei", "cautious")  # given up where two deviations hold none


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Points (m, d) to run next; predictions (m,) of the signed response, with their standard deviations."""

    u: np.ndarray
    proposals: tuple[str, ...]
    predicted: np.ndarray
    std: np.ndarray


def propose(
    known: Known, turn: Turn, *, size: int, rng: np.random.Generator, border: BorderWalk | None = None
) -> Batch:
    """Up to `size` points, the first of a batch along the `border` of failures where that gains; fewer come
    back when no admissible point is left.
    """
    where = known.where
    choice = _Choice(
        known=known, finishing=turn.finishing, pool=start_pool(where, known.incumbent, rng), rng=rng
    )
    chosen: list[np.ndarray] = []
    names: list[str] = []
    attempt = 0
    turns, elsewhere = turns_of(where, turn)
    gaining = None if border is None else border.next_point(known, choice.pool, rng=rng)
    if gaining is not None:
        chosen.append(gaining)
        names.append(BORDER)
        if size > 1:
            choice = replace(choice, known=known.believing(gaining))
    while len(chosen) < size and attempt < size + len(turns):
        name = turns[(turn.number + attempt) % len(turns)]
        attempt += 1
        for other in dict.fromkeys((name, *elsewhere)):
            point = choice.promising(other)
            if point is None:
                continue
            chosen.append(point)
            names.append(other)
            if len(chosen) < size:
                # one run of a batch is enough to refine the worst
                choice = replace(choice, known=choice.known.believing(point), finishing=False)
                turns, elsewhere = turns_of(where, replace(turn, finishing=False))
            break
    points = np.stack(chosen) if chosen else np.empty((0, where.dimension))
    mean, std = known.model.in_units(where.features(points)) if chosen else (np.empty(0), np.empty(0))
    return Batch(u=points, proposals=tuple(names), predicted=mean, std=std)


@dataclass(frozen=True, kw_only=True)
class _Choice:
    """The choice of one point: what is known, starts (m, d), and what is worked out only when asked for."""

    known: Known
    finishing: bool
    pool: np.ndarray
    rng: np.random.Generator

    def promising(self, name: str) -> np.ndarray | None:
        """The point (d,) of a proposal, None where it has none or promises no noticeable gain."""
        known = self.known
        if name == "hill":
            point = None if self.peak is None else self.peak.next_point(known)
        elif name == "explore" and self.is_smooth:
            # the model of the search may hold all but the known peak for flat
            point = best_point(name, replace(known, model=self.rough), self.pool)
        else:
            point = best_point(name, known, self.pool)
        if point is None or self.finishing:
            return point
        return None if _is_vain(name, known.model, known.where.features(point[None])) else point

    @property
    def is_smooth(self) -> bool:
        """Whether other peaks and rough models serve: with levels, every combination of them would be a peak,
        and rough models explore where runs fail.
        """
        return not self.finishing and not self.known.where.discrete

    @cached_property
    def peak(self) -> Peak | None:
        """The peak to climb next."""
        return next_peak(self.known, rng=self.rng) if self.is_smooth else None

    @cached_property
    def rough(self) -> SearchModel:
        """The roughest credible model."""
        known = self.known
        features = known.where.features(known.u_ok)
        return fit_rough_model(features, known.v, known.model, seed=known.model.kriging.seed)


def _is_vain(name: str, model: SearchModel, features: np.ndarray) -> bool:
    """Whether a point promises no noticeable gain, within one deviation to refine and two to seek."""
    if name in LOCAL:
        return not model.promises(features, 1.0)
    return name in SOUGHT and not any(m.promises(features, 2.0) for m in (model, model.cautious or model))


def predicted_worst(known: Known, *, rng: np.random.Generator) -> np.ndarray:
    """The point (d,) of the largest predicted value, runs themselves included."""
    none = np.empty((0, known.where.dimension))
    pool = start_pool(known.where, known.incumbent, rng)
    point = best_point("predicted", replace(known, u=none), pool)
    return known.incumbent if point is None else point

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
    hill         around the top of the next hill (`workbench.search.proposals.other_peaks`), by a model of the
    runs near it: by turns
                 the largest expected gain over it and the largest upper confidence bound
    explore      the highest upper bound of the roughest credible model among random points

As long as runs gain, expected improvement and upper confidence bound take turns. A turn that promises no
noticeable gain goes to the next hill, else to the cautious model, else to an exploration; after a stall the
turns are shared out among all proposals.

Every proposal is multiplied with the chance that the run succeeds, and none lies closer than a thousandth
of the cube to a run already made. After each point of a batch the models believe their own prediction
there, so that the next one goes where it teaches something, a twentieth of the cube away at least.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from workbench.search.proposals.best_point import best_point, box_levels, start_pool
from workbench.search.proposals.other_peaks import HALF_WIDTH, next_hill
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.feasibility import Feasibility
from workbench.search.surrogate.model import (
    SearchModel,
    believing,
    fit_local_model,
    fit_rough_model,
)

__all__ = ["Batch", "predicted_worst", "propose"]

NORMAL = ("ei", "ucb")
STALLED = (
    "hill", "hill", "explore", "hill", "hill", "ei", "hill", "hill", "cautious", "hill", "trust", "flip",
)  # fmt: skip
FINISHING = ("predicted", "predicted", "trust")
LOCAL = ("ucb", "predicted", "trust", "flip")  # given up where one deviation holds no noticeable gain
SOUGHT = ("ei", "cautious")  # given up where two deviations hold none
ELSEWHERE = ("hill", "cautious", "explore")  # what takes a turn that holds no gain, the first that may
VALLEY = 0.03  # of the range of the values: how deep a valley parts two hills
DOUBT = 1.0  # deviations: a valley that deep is not excluded by the runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Points (m, d) to run next; predictions (m,) of the signed response, with their standard deviations."""

    u: np.ndarray
    proposals: tuple[str, ...]
    predicted: np.ndarray
    std: np.ndarray


def propose(
    where: SearchSpace,
    model: SearchModel,
    *,
    u: np.ndarray,
    u_ok: np.ndarray,
    v: np.ndarray,
    incumbent: np.ndarray,
    feasibility: Feasibility,
    iteration: int,
    stalled: bool,
    finishing: bool,
    size: int,
    rng: np.random.Generator,
) -> Batch:
    """Up to `size` points for runs made at u (n, d), failed ones included; those at u_ok (m, d) gave values
    v (m,), and `incumbent` (d,) is the worst of them.

    `stalled`: nothing gained for long. `finishing`: the last runs of the budget, which refine the worst run.

    Fewer come back when no admissible point is left.
    """
    state = _State(
        where=where,
        model=model,
        u=u,
        u_ok=u_ok,
        v=v,
        incumbent=incumbent,
        feasibility=feasibility,
        finishing=finishing,
        pool=start_pool(where, incumbent, rng),
        rng=rng,
        under_way=np.empty((0, where.dimension)),
    )
    chosen: list[np.ndarray] = []
    names: list[str] = []
    attempt = 0
    turns, elsewhere = _turns(where, iteration, stalled=stalled, finishing=finishing)
    while len(chosen) < size and attempt < size + len(turns):
        name = turns[(iteration + attempt) % len(turns)]
        attempt += 1
        for other in dict.fromkeys((name, *elsewhere)):
            point = state.promising(other)
            if point is not None:
                chosen.append(point)
                names.append(other)
                if len(chosen) < size:
                    state = state.believing(point)
                    turns, elsewhere = _turns(where, iteration, stalled=stalled, finishing=False)
                break
    points = np.stack(chosen) if chosen else np.empty((0, where.dimension))
    mean, std = model.in_units(where.features(points)) if chosen else (np.empty(0), np.empty(0))
    return Batch(u=points, proposals=tuple(names), predicted=mean, std=std)


def _turns(
    where: SearchSpace, iteration: int, *, stalled: bool, finishing: bool
) -> tuple[list[str], tuple[str, ...]]:
    """The proposals that take turns, and those that take a turn without promise."""
    turns = list(FINISHING if finishing else STALLED if stalled else NORMAL)
    elsewhere: tuple[str, ...] = () if finishing else ELSEWHERE
    if where.combinations() is not None and not where.is_finite and not finishing:
        for at in range(len(turns) // 2, 0, -1):
            turns.insert(2 * at, "combination")
        elsewhere = ("combination", *ELSEWHERE) if iteration % 3 == 0 else ELSEWHERE
    return turns, elsewhere


@dataclass(frozen=True, kw_only=True)
class _State:
    """What is known when the next point of a batch is chosen: runs u (n, d), values v (m,) at u_ok (m, d)."""

    where: SearchSpace
    model: SearchModel
    u: np.ndarray
    u_ok: np.ndarray
    v: np.ndarray
    incumbent: np.ndarray
    feasibility: Feasibility
    finishing: bool
    pool: np.ndarray
    rng: np.random.Generator
    under_way: np.ndarray

    def promising(self, name: str) -> np.ndarray | None:
        """The point (d,) of a proposal, None where it has none or promises no noticeable gain."""
        where = self.where
        if name == "hill":
            point = (
                None if self.hill is None else self.hill.climb(where, self.model, self.u, self.feasibility)
            )
        else:
            point = best_point(
                name,
                where,
                # the model of the search may hold all but the known peak for flat
                self.rough if name == "explore" and self.is_smooth else self.model,
                taken=self.u,
                incumbent=self.incumbent,
                feasibility=self.feasibility,
                pool=self.pool,
                under_way=self.under_way,
            )
        if point is None or self.finishing:
            return point
        return None if _is_vain(name, self.model, where.features(point[None])) else point

    def believing(self, point: np.ndarray) -> "_State":
        """The same with a run at `point` (d,) that gives what the model predicts there; one run of a batch is
        enough to refine the worst.
        """
        u_ok = np.vstack([self.u_ok, point])
        features = self.where.features(u_ok)
        v = np.append(self.v, self.model.mean(features[-1:]))
        return replace(
            self,
            model=believing(self.model, features, v),
            u=np.vstack([self.u, point]),
            u_ok=u_ok,
            v=v,
            finishing=False,
            under_way=np.vstack([self.under_way, point]),
        )

    @property
    def is_smooth(self) -> bool:
        """Whether hills and rough models serve: with levels, every combination of them would be a hill, and
        rough models explore where runs fail.
        """
        return not self.finishing and not self.where.discrete

    @cached_property
    def hill(self) -> "_Hill | None":
        """The hill to climb next."""
        if not self.is_smooth:
            return None
        return _next_hill(self.where, self.model, u_ok=self.u_ok, v=self.v, rng=self.rng)

    @cached_property
    def rough(self) -> SearchModel:
        """The roughest credible model."""
        features = self.where.features(self.u_ok)
        return fit_rough_model(features, self.v, self.model, seed=self.model.kriging.seed)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Hill:
    """The hill to climb next: its top (d,), the value there, a model of the runs around it, starts (m, d)."""

    top: np.ndarray
    value: float
    model: SearchModel
    pool: np.ndarray

    def climb(
        self, where: SearchSpace, model: SearchModel, taken: np.ndarray, feasibility: Feasibility
    ) -> np.ndarray | None:
        """By turns the best bound of the box around the top, where the mean gains, and the best expected
        gain.
        """

        def best(name: str, target: float | None) -> np.ndarray | None:
            return best_point(
                name,
                where,
                self.model,
                taken=taken,
                incumbent=self.top,
                feasibility=feasibility,
                pool=self.pool,
                target=target,
                levels=box_levels(where, self.top, HALF_WIDTH, 81),
            )

        if len(taken) % 2:
            point = best("ucb", None)
            gains = point is not None and (
                self.model.mean(where.features(point[None]))[0] >= self.value + model.noticeable
            )
            if gains:
                return point
        return best("ei", self.value)


def _next_hill(
    where: SearchSpace, model: SearchModel, *, u_ok: np.ndarray, v: np.ndarray, rng: np.random.Generator
) -> _Hill | None:
    judge, depth = model.cautious or model, VALLEY * float(np.ptp(v))
    index = next_hill(
        u_ok,
        v,
        lambda points: judge.bound(where.features(points), -DOUBT),
        depth=depth,
        gain=model.noticeable,
    )
    if index is None:
        return None
    features = where.features(u_ok)
    return _Hill(
        top=u_ok[index],
        value=float(v[index]),
        model=fit_local_model(features, v, features[index], seed=model.kriging.seed),
        pool=start_pool(where, u_ok[index], rng),
    )


def _is_vain(name: str, model: SearchModel, features: np.ndarray) -> bool:
    """Whether a point promises no noticeable gain, within one deviation to refine and two to seek."""
    if name in LOCAL:
        return not model.promises(features, 1.0)
    return name in SOUGHT and not any(m.promises(features, 2.0) for m in (model, model.cautious or model))


def predicted_worst(
    where: SearchSpace,
    model: SearchModel,
    *,
    incumbent: np.ndarray,
    feasibility: Feasibility,
    rng: np.random.Generator,
) -> np.ndarray:
    """The point (d,) of the largest predicted value, runs themselves included."""
    none = np.empty((0, where.dimension))
    pool = start_pool(where, incumbent, rng)
    point = best_point(
        "predicted", where, model, taken=none, incumbent=incumbent, feasibility=feasibility, pool=pool
    )
    return incumbent if point is None else point

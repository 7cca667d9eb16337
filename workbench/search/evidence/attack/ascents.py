"""Climbs side by side, the budget going where it earns.

Climbs begin at cases known to be bad and at the claimed one, which is where a claim is attacked first, and
at the worst drawn case of every stratum that is a top among its runs, in turns: one turn climbs corners, the
next inside; every turn does where all corners were run before. Once every stratum has had its corners
climbed, and `ENOUGH` climbs from drawn cases have ended at the worst value known, more of them would only
repeat it: the budget then goes into cases far from all that were run, in batches, with a climb from the one
that stands furthest out of the trend.

A climb's last step is a fiftieth of the side, and on a sharp top or along a bent ridge that leaves some per
cent. In the last third of the budget one more climb goes beside the others, from the worst case known in ever
shorter steps, and again from a worse one that they find.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from workbench.search.evidence.attack.climbs import Climb, Step, corner_climb, interior_climb, local_climb
from workbench.search.evidence.attack.empty_places import CANDIDATES, emptiest
from workbench.search.evidence.attack.strata import Strata
from workbench.search.evidence.attack.surprise import surprises
from workbench.search.evidence.attack.tops import is_top
from workbench.search.evidence.attack.trials import Trials
from workbench.space.streams import stream

__all__ = ["BELOW", "Arrivals", "Ascents"]

SIDE_BY_SIDE = 4  # climbs at once: the size of a batch, whatever the number of workers
FRESH, REDRAWS = 8, 20  # near-corners drawn when no case is left to climb from, and how often
ENOUGH = 2  # climbs from drawn cases that end at the worst value before the budget goes elsewhere
PAIRS, OF_BUDGET = 100, 15  # of changes at the top of a corner climb: at most, and as a part of the budget
TRIED = 50  # of the worst cases of a stratum that are looked at for a top
FAR = 16  # cases in empty places before the next climb
FINE = 1 / 3  # of the budget is left when the worst case known is climbed from in short steps
NEAR = 0.02  # of the value or of the range of the values, the smaller: a climb that ends so near has arrived
# a climb that ended on the peak of the worst case has arrived, too: no further beside it, of the side, and no
# more below it, of what `NEAR` is of
BESIDE, BELOW = 1 / 16, 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrivals:
    """Climbs that began at drawn cases, not at the claimed or a known one, and how many `arrived`: within 2 %
    of the worst known, or within 5 % and a sixteenth of the side beside it, where one in short steps has
    raised the worst since."""

    begun: int = 0
    arrived: int = 0


@dataclass(slots=True, kw_only=True)
class _Going:
    """A climb, where it began, the next case it wants run, and the worst that it has met with its signed
    value."""

    climb: Climb
    origin: Literal["known", "drawn", "worst"]
    top: np.ndarray
    worst: float
    step: Step | None = None

    def asks(self, trials: Trials, value: float | None) -> bool:
        """Go on until a case is asked for that was not run; False when the climb has ended."""
        try:
            self.step = next(self.climb) if value is None else self._sent(value)
            while (known := trials.known(self.step.point)) is not None:
                self.step = self._sent(known)
        except StopIteration:
            return False
        return True

    def _sent(self, value: float) -> Step:
        if value > self.worst and self.step is not None:
            self.top, self.worst = self.step.point, value
        return self.climb.send(value)


@dataclass(slots=True, kw_only=True)
class Ascents:
    """Climbs side by side, until the budget ends. `claimed`: the attacked case (d,) and its signed value;
    `known`: others that are nearly as bad. Where an attack `goes_on`, none but local climbs begin at them.
    `enough`: the signed value beyond which no more is sought once the climbs from known cases have ended.
    `has_all_corners`: every corner was run, so that climbs from drawn cases go inside."""

    trials: Trials
    strata: Strata
    seed: int
    claimed: tuple[np.ndarray, float] | None = None
    known: Sequence[tuple[np.ndarray, float]] = ()
    goes_on: bool = False
    enough: float | None = None
    has_all_corners: bool = False
    climbs: list[_Going] = field(default_factory=list)
    redrawn: int = 0
    used: set[int] = field(default_factory=set)
    plain: list[int] = field(default_factory=list)

    def run(self) -> Arrivals:
        """Climb, and begin another climb whenever one has ended."""
        self.plain = [i for i, kind in enumerate(self.trials.kinds) if kind != "scouted"]
        active: list[_Going] = []
        starts = self._starts()
        while self.trials.left > 0:
            while sum(g.origin != "worst" for g in active) < SIDE_BY_SIDE:
                if (begun := self._next(starts)) is None:
                    break
                active.append(begun)
            if (fine := self._fine(active)) is not None:
                active.append(fine)
            steps = [going.step for going in active if going.step is not None]
            if not steps:
                break
            values = self.trials.run([step.point for step in steps], [step.kind for step in steps])
            active = [g for g, v in zip(active, values, strict=False) if g.asks(self.trials, v)]
            if self._has_enough(active):
                break
        return self.arrivals()

    def _has_enough(self, active: list[_Going]) -> bool:
        """Whether the claim is broken and no climb from a known case goes on."""
        if self.enough is None or any(going.origin == "known" for going in active):
            return False
        return max(self.trials.values) > self.enough

    def arrivals(self) -> Arrivals:
        """How many climbs from drawn cases have met the worst value known."""
        drawn = [going for going in self.climbs if going.origin == "drawn"]
        points, values = self._known_cases()
        finite = values[values > -np.inf]
        if not len(finite):
            return Arrivals(begun=len(drawn))
        worst = int(np.argmax(values))
        scale = min(float(np.ptp(finite)), float(np.abs(finite).max()))

        def has_arrived(going: _Going) -> bool:
            away, below = np.abs(going.top - points[worst]).max(), values[worst] - going.worst
            return bool(below <= NEAR * scale or (below <= BELOW * scale and away <= BESIDE))

        return Arrivals(begun=len(drawn), arrived=sum(map(has_arrived, drawn)))

    def _next(self, starts: Iterator[_Going]) -> _Going | None:
        """The next climb that has a case to run; None where nothing is left to climb."""
        for going in starts:
            self.climbs.append(going)
            if going.asks(self.trials, None):
                return going
        return None

    def _fine(self, active: Sequence[_Going]) -> _Going | None:
        """A climb in short steps from the worst case known, where none goes on and none has met it."""
        if self.trials.left > FINE * self.trials.budget or any(going.origin == "worst" for going in active):
            return None
        points, values = self._known_cases()
        worst = int(np.argmax(values))
        met = [going.worst for going in self.climbs if going.origin == "worst"]
        if self.goes_on and self.claimed is not None:
            met.append(self.claimed[1])
        if values[worst] <= max(met, default=-np.inf):
            return None
        going = self._begun(points[worst], float(values[worst]), origin="worst")
        self.climbs.append(going)
        return going if going.asks(self.trials, None) else None

    def _starts(self) -> Iterator[_Going]:
        """Climbs from known cases and from the claimed one, then from the worst tops of the strata by turns,
        and from new near-corners when no drawn case is left; from cases in empty places once enough have
        arrived."""
        for start, value in self.known:
            yield self._begun(start, value, origin="known", is_local=True)
        if self.claimed is not None and not self.goes_on:
            for corners in (True, False):
                yield self._begun(*self.claimed, corners=corners, origin="known")
        places = self.plain
        turn = 0
        while True:
            queue = self._queue(places)
            if not queue:
                places = self._more()
                if not places:
                    return
                continue
            for i in queue:
                corners = turn % 2 == 0 and not self.has_all_corners
                if turn > 0 and self.arrivals().arrived >= ENOUGH:
                    yield from self._elsewhere(corners=corners)
                if i not in self.used:
                    yield self._from(i, corners=corners, holds_labels=turn == 0)
            turn += 1

    def _elsewhere(self, *, corners: bool) -> Iterator[_Going]:
        """A climb from the case that stands out most, once some more were run in empty places."""
        trials, where = self.trials, self.strata.where
        rng = stream(self.seed, "attack empty places", replicate=len(self.climbs))
        candidates = self.strata.inside(CANDIDATES, rng)
        if not len(candidates):
            return
        features = where.features(candidates)
        chosen = candidates[emptiest(features, where.features(np.array(trials.points)), FAR)]
        before = len(trials.outcomes)
        trials.run(chosen, ["empty place"] * len(chosen))
        self.plain = [*self.plain, *range(before, len(trials.outcomes))]
        points = np.array([trials.points[i] for i in self.plain])
        scores = surprises(where.features(points), np.array([trials.values[i] for i in self.plain]))
        scores[[i in self.used for i in self.plain]] = -np.inf
        if np.max(scores) > -np.inf:
            yield self._from(self.plain[int(np.argmax(scores))], corners=corners)

    def _more(self) -> list[int]:
        """Run a few new near-corners; the places of those that were new, none where none is left."""
        before = len(self.trials.outcomes)
        for _ in range(REDRAWS):
            self.redrawn += 1
            rng = stream(self.seed, "attack again", replicate=self.redrawn)
            fresh = self.strata.near_corners(FRESH, rng)
            self.trials.run(fresh, ["near corner"] * len(fresh))
            if len(self.trials.outcomes) > before:
                break
        return list(range(before, len(self.trials.outcomes)))

    def _queue(self, places: list[int]) -> list[int]:
        """A case of each stratum that no climb has begun at, the strata with the worst ones first: the worst
        that is a top among all cases known of its stratum, or the worst of all where `TRIED` are none."""
        points, values = self._known_cases()
        open_ = np.array([i for i in places if i not in self.used and values[i] > -np.inf], dtype=int)
        if not len(open_):
            return []
        index = self.strata.index(points)
        worst_first = open_[np.argsort(-values[open_], kind="stable")]
        chosen = []
        for stratum in np.unique(index[open_]):
            here = np.flatnonzero((index == stratum) & (values > -np.inf))
            chosen.append(_first_top(worst_first[index[worst_first] == stratum], here, points, values))
        return sorted(chosen, key=lambda i: -values[i])

    def _known_cases(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, d) and signed values (n,) of all runs, followed by the claimed case and known ones."""
        given = [*([] if self.claimed is None else [self.claimed]), *self.known]
        points = np.array([*self.trials.points, *(point for point, _ in given)])
        return points, np.array([*self.trials.values, *(value for _, value in given)])

    def _from(self, i: int, *, corners: bool, holds_labels: bool = False) -> _Going:
        self.used.add(i)
        return self._begun(
            self.trials.points[i], self.trials.values[i], corners=corners, holds_labels=holds_labels
        )

    def _begun(
        self,
        start: np.ndarray,
        value: float,
        *,
        corners: bool = False,
        holds_labels: bool = False,
        origin: Literal["known", "drawn", "worst"] = "drawn",
        is_local: bool = False,
    ) -> _Going:
        """A climb from `start`: a fine one from the worst, a local one, one of corners, or one inside."""
        trials, number = self.trials, len(self.climbs)
        rng = stream(self.seed, "climb", replicate=number)
        climb: Climb
        if origin == "worst" or is_local:
            is_fine = origin == "worst"
            climb = local_climb(trials.where, start, value, slope=trials.slope, rng=rng, is_fine=is_fine)
        elif corners:
            climb = corner_climb(
                trials.where, start, value, slope=trials.slope, spread=lambda: _spread(trials.values),
                rng=rng, holds_labels=holds_labels, pairs=min(PAIRS, trials.budget // OF_BUDGET),
            )  # fmt: skip
        else:
            climb = interior_climb(trials.where, start, value, slope=trials.slope, rng=rng)
        return _Going(climb=climb, origin=origin, top=start, worst=value)


def _first_top(cases: np.ndarray, here: np.ndarray, points: np.ndarray, values: np.ndarray) -> int:
    """The first of some `cases` that is a top among the runs `here`; the first one where none is."""
    for i in cases[:TRIED]:
        if is_top(int(np.flatnonzero(here == i)[0]), points[here], values[here]):
            return int(i)
    return int(cases[0])


def _spread(values: list[float]) -> float:
    """The range of the values of runs that gave one."""
    finite = np.array(values)[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0

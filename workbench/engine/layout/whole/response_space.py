"""Search among whole members by predictions of their histories.

Two predictions (`prediction.py`) take turns: each proposes the choice of the largest expected improvement,
its deviations enlarged as its last errors were, and at every other turn that of the best expected value.
Where there are few enough choices, all of them are candidates, otherwise steps beside the best ones, what
descent by swaps in the prediction leads to, and random ones. A prediction from which nothing is expected any
more rests; once both rest, steps beside the best choice are looked at until none is left: it cannot be
improved by one swap. Then deviations are doubled, three times, before the search ends ahead of its limit.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from .choices import Choices, On
from .evaluated import Evaluated
from .prediction import KINDS, Prediction, Setting, predicted

__all__ = ["response_space_search"]

Array = NDArray[np.float64]

_FIRST = 8  # random choices before a prediction is asked
_ALL = 20_000  # choices up to which all of them are candidates
_CANDIDATES = 3000  # of more
_SHORT = 300  # candidates whose improvement is asked for
_AGAIN = 15  # looks after which a prediction chooses its setting and its candidates again
_SOON = 5  # looks after a choice of candidates, within which it is not made again
_REST = 25  # turns
_NOTHING = 1e-3  # expected improvement, relative, that is not worth a simulation
_ERRORS = 20  # the latest, by which a prediction is doubted
_DOUBT = 8.0  # factor of deviations up to which a search goes on
_DESCENTS = 3
_SWAPS = 12  # of each


class _Turns:
    """A kind of prediction and what it keeps from one turn to the next."""

    def __init__(self, kind: str) -> None:
        self.kind, self.since, self.rest = kind, _AGAIN, 0
        self.setting: Setting | None = None
        self.prediction: Prediction | None = None
        self.candidates: list[On] = []
        self.errors: list[float] = []

    @property
    def doubt(self) -> float:
        """As sure as it has been right: the deviations of the last looks, no less than foretold."""
        if not self.errors:
            return 1.0
        return float(np.clip(np.sqrt(np.mean(np.square(self.errors[-_ERRORS:]))), 1.0, _DOUBT))


def response_space_search(seen: Evaluated, choices: Choices, *, rng: np.random.Generator) -> bool:
    """Look at choices until the limit; True when every step beside the best one was looked at."""
    _first_looks(seen, choices, rng)
    if seen.left <= 0 or not np.isfinite(seen.values).any():
        return False
    everything = choices.everything(at_most=_ALL)
    turns = [_Turns(kind) for kind in (KINDS if seen.runs.histories[0].size > 1 else KINDS[1:])]
    number, doubt = 0, 1.0
    while seen.left > 0:
        best = seen.values[seen.best]
        if all(turn.rest > 0 for turn in turns):
            beside = [on for on in choices.beside(seen.on[seen.best]) if on not in seen]
            if beside:
                last = predicted(seen.runs, turns[-1].kind, turns[-1].setting)
                value = seen.look(_best(seen, last, beside, 1.0)[0])
            else:
                doubt *= 2.0
                if doubt > _DOUBT:
                    return True
                value = -np.inf
        else:
            turn = turns[number % len(turns)]
            boldly = number // len(turns) % 2 == 1
            number += 1
            step = _turn(seen, choices, turn, everything, 0.0 if boldly else doubt, rng)
            if step is None:
                continue
            value = seen.look(step)
            if np.isfinite(value) and turn.prediction is not None:
                turn.errors.append(turn.prediction.error(_features(seen, turn.prediction, step[None]), value))
        if value < best:
            for turn in turns:
                turn.rest = 0
    return all(on in seen for on in choices.beside(seen.on[seen.best]))


def _first_looks(seen: Evaluated, choices: Choices, rng: np.random.Generator) -> None:
    """A few random choices, and more while none could be simulated."""
    for tried in range(4 * max(_FIRST, seen.left)):
        enough = len(seen.values) > _FIRST or tried >= 4 * _FIRST
        if seen.left <= 0 or (enough and np.isfinite(seen.values).any()):
            break
        seen.look(choices.filled(rng.permutation(choices.states)))


def _turn(
    seen: Evaluated, choices: Choices, turn: _Turns, everything: list[On] | None, doubt: float,
    rng: np.random.Generator,
) -> On | None:  # fmt: skip
    """What a prediction proposes; None where it rests, or expects nothing of its candidates.

    doubt: 0 for the candidate that is expected to be best, as if the prediction were sure.
    """
    if turn.rest > 0:
        turn.rest -= 1
        return None
    again = turn.since >= _AGAIN
    prediction = turn.prediction = predicted(seen.runs, turn.kind, None if again else turn.setting)
    if again:
        turn.setting, turn.since = prediction.setting, 0
        turn.candidates = _candidates(seen, choices, prediction, everything, rng)
    pool = [on for on in turn.candidates if on not in seen]
    step, improvement = _best(seen, prediction, pool, doubt * turn.doubt) if pool else (None, 0.0)
    if improvement <= _NOTHING and doubt == 0.0:
        return None
    if improvement <= _NOTHING:
        turn.rest = _REST if turn.since < _SOON else 0  # otherwise other candidates first
        turn.since = _AGAIN
        return None
    turn.since += 1
    return step


def _best(seen: Evaluated, prediction: Prediction, pool: list[On], doubt: float) -> tuple[On, float]:
    several = np.array(pool)
    at, best = _features(seen, prediction, several), seen.values[seen.best]
    if doubt == 0.0:
        improvement = np.arcsinh(best / prediction.unit) - prediction.values(at)
    else:
        improvement = prediction.improvement(at, best, doubt=doubt)
    improvement *= _stands(seen, several)
    place = int(improvement.argmax())
    return pool[place], float(improvement[place])


def _features(seen: Evaluated, prediction: Prediction, several: On) -> Array:
    return prediction.features(several.astype(float), seen.choices.table)


def _stands(seen: Evaluated, several: On) -> Array:
    """(p,): the share of designs nearby, by states that differ, that could be simulated."""
    failed = ~np.isfinite(seen.values)
    if not failed.any():
        return np.ones(len(several))
    weight = np.exp(-cdist(several.astype(float), np.array(seen.on, dtype=float), "cityblock"))
    return np.asarray(1.0 - weight[:, failed].sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-300))


def _candidates(
    seen: Evaluated, choices: Choices, prediction: Prediction, everything: list[On] | None,
    rng: np.random.Generator,
) -> list[On]:  # fmt: skip
    if everything is not None:
        pool = [on for on in everything if on not in seen]
    else:
        pool = [on for on in _pool(seen, choices, prediction, rng) if on not in seen]
    if len(pool) <= _SHORT:
        return pool
    expected = prediction.values(_features(seen, prediction, np.array(pool)))
    return [pool[k] for k in np.argsort(expected, kind="stable")[:_SHORT]]


def _pool(seen: Evaluated, choices: Choices, prediction: Prediction, rng: np.random.Generator) -> list[On]:
    """Steps beside the best choices and where descent by swaps in the prediction ends, and random ones."""
    order = [k for k in np.argsort(seen.values, kind="stable")[:4] if np.isfinite(seen.values[k])]
    pool = {on.tobytes(): on for place in order for on in choices.beside(seen.on[place])}
    starts = [seen.on[k] for k in order[:2]]
    starts += [choices.filled(rng.permutation(choices.states)) for _ in range(_DESCENTS - len(starts))]
    for on in starts:
        value = np.inf
        for _ in range(_SWAPS):
            beside = choices.beside(on)
            if not beside:
                break
            expected = prediction.values(_features(seen, prediction, np.array(beside)))
            if expected.min() >= value:
                break
            value, on = float(expected.min()), beside[int(expected.argmin())]
            pool[on.tobytes()] = on
        for k in rng.permutation(len(beside))[: _CANDIDATES // _DESCENTS]:
            pool[beside[k].tobytes()] = beside[k]
    for _ in range(300):
        on = choices.filled(rng.permutation(choices.states))
        pool[on.tobytes()] = on
    return list(pool.values())

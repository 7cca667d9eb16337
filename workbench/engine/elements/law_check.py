"""Slopes of a user's law against differences of its force, where the law is made."""

from collections.abc import Callable
from itertools import product

import numpy as np

__all__ = ["check_slopes"]

# places without meaning, so that a law seldom has a kink there: m, m/s, s
_ELONGATIONS = (-0.3137, -0.0523, -0.00319, 0.00427, 0.0611, 0.4153)
_RATES = (-2.173, -0.1127, 0.1531, 3.091)
_TIMES = (0.0, 0.7171)
STEP = 1e-6
APART = 1e-3  # of the larger slope
SMALL = 1e-9  # of the largest slope anywhere

Look = Callable[[float, float, float], tuple[float, float, float]]  # two numbers, t -> f, its two slopes


def check_slopes(
    name: str, look: Look, *, given: bool = False, by: tuple[str, str] = ("delta", "rate")
) -> None:
    """Raises ValueError where a slope differs from central differences that two steps agree on.

    Places where the force is no number, or where differences do not settle (kinks, rounding of very stiff
    laws), are passed over: a law may be made for a part of them.

    given: whether the slopes are the user's own.  by: the two numbers of the slopes.  Both for the words.
    """
    places = list(product(_ELONGATIONS, _RATES, _TIMES))
    seen = np.abs([look(*place)[1:] for place in places])
    least = SMALL * np.max(seen, axis=0, where=np.isfinite(seen), initial=0.0)
    for place in places:
        f, *slopes = look(*place)
        for k, what in enumerate(by):
            coarse, fine = (_difference(look, place, k, step) for step in (STEP, STEP / 4))
            noise = 1e-14 * abs(f) / STEP + least[k]
            size = max(abs(slopes[k]), abs(fine))
            settled = abs(coarse - fine) <= 0.1 * APART * size + noise  # not where one is no number
            if settled and not abs(slopes[k] - fine) <= APART * size + 10.0 * noise:
                there = ", ".join(f"{key}={x}" for key, x in zip((*by, "t"), place, strict=True))
                raise ValueError(
                    f"the function '{name}' of a law has a slope by {what} of {slopes[k]:.6g} "
                    f"{'as given' if given else 'by complex step'} at {there}, where differences give "
                    f"{fine:.6g}; {'correct slopes' if given else _CURE}"
                )


_CURE = (
    "write it without abs, max and min and with branches by delta.real or rate.real, so that it is analytic, "
    "or give slopes where the law takes them"
)


def _difference(look: Look, place: tuple[float, float, float], k: int, step: float) -> float:
    """Central difference of the force by number k of a place."""
    ends = []
    for sign in (1.0, -1.0):
        moved = list(place)
        moved[k] += sign * step
        ends.append(look(*moved)[0])
    return (ends[0] - ends[1]) / (2.0 * step)

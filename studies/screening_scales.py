"""What it is worth to let a screening choose the scale of its response, on responses over decades and others.

Responses over one, two and three decades are exponentials of drawn functions; beside them stand the
published functions of `studies.screening_lists`. Each is screened twice on the same runs: as it is, and on
the scale that predicts left-out runs best. Truth is the total index of each input on the response's own
scale. Counted are

    lacks 5 %    screenings whose list lacks an input above 5 %
    above x      screenings that lack an input above the share that their verdict names
    crumbs       screenings that list an input below 1 %
    x            the median of that share

`python -m studies.screening_scales 0 4` takes seeds 0 to 3; each seed draws designs, and functions too.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

import doe
from studies.asked_range import asked_range
from studies.screening_lists import CRUMB, FUNCTIONS, STRONG, Listed, drawn_function, jansen_indices
from surrogates import KrigingScreener, choose_scale, judged_on_response, on_scale

__all__ = ["Counted", "count", "main", "over_decades"]

Array = NDArray[np.float64]

PUBLISHED = ("wing", "flood", "robot", "cantilever", "environment", "loeppky", "circuit", "pulse")
DECADES = (1, 2, 3)  # between minus and plus two standard deviations of the exponent
NOISES = (0.0, 0.05)  # of the standard deviation of the response


@dataclass(slots=True)
class Counted:
    """Screenings of one kind, and how many of them lack or hold what the module's docstring says."""

    screenings: int = 0
    resolved: int = 0
    lacks: int = 0
    beyond: int = 0
    crumbs: int = 0
    x: tuple[float, ...] = ()

    def add(self, screener: KrigingScreener, total: Array) -> None:
        """Count a fitted screening of inputs with these true total indices (d,)."""
        inside, facts = screener.get_support(), screener.diagnosis_
        self.screenings += 1
        self.resolved += facts.state == "resolved"
        self.lacks += bool((~inside & (total > STRONG)).any())
        self.beyond += bool((~inside & (total > facts.hidden_share)).any())
        self.crumbs += bool((inside & (total < CRUMB)).any())
        self.x += (facts.hidden_share,)

    def __str__(self) -> str:
        return (
            f"{self.screenings} screenings: resolved {self.resolved}, lacks 5 % {self.lacks}, above x "
            f"{self.beyond}, crumbs {self.crumbs}, median x {100 * float(np.median(self.x)):.2g} %"
        )


def over_decades(seed: int, decades: float) -> Listed:
    """A positive response: the exponential of a drawn function, over so many decades."""
    drawn = drawn_function(seed)
    sample = drawn.evaluate(np.random.default_rng([seed, 5]).random((2000, drawn.d)))
    mean, rate = float(sample.mean()), decades * np.log(10) / 4 / float(sample.std())
    return Listed(drawn.d, lambda x: np.exp(rate * (drawn.evaluate(x) - mean)))


def count(
    functions: Sequence[Listed], seeds: Sequence[int], *, runs_per_input: int = 5
) -> dict[str, Counted]:
    """Screenings of 5 d + 6 runs of optimised Latin hypercubes, as they are and on the chosen scale."""
    found = {"as it is": Counted(), "chosen": Counted()}
    for function, seed, noise in product(functions, seeds, NOISES):
        rng = np.random.default_rng([seed, function.d, round(100 * noise)])
        n = runs_per_input * function.d + 6
        points = doe.optimised_lhs(n, function.d, swaps=20_000, rng=rng)
        y = function.evaluate(points)
        y = y + noise * y.std() * rng.standard_normal(n)
        scale = choose_scale(KrigingScreener(), points, y).scale
        total = jansen_indices(function)
        for name, taken in (("as it is", "none"), ("chosen", scale)):
            screener = KrigingScreener().fit(points, on_scale(y, taken))
            found[name].add(judged_on_response(screener, points, y, taken), total)
    return found


def main(seeds: Sequence[int]) -> None:
    """Print the counts of each kind of response."""
    kinds = {
        f"{decades} decades": [over_decades(2000 + 7 * seed + decades, decades) for seed in seeds]
        for decades in DECADES
    } | {"published": [FUNCTIONS[name] for name in PUBLISHED]}
    for kind, functions in kinds.items():
        for name, counted in count(functions, seeds).items():
            print(f"{kind:10s} {name:9s} {counted}", flush=True)


if __name__ == "__main__":
    main(asked_range(sys.argv[1:], default=(0, 2)))

"""Does the stated gap hold? Searches of functions with both extremes known, and how often the gap covers.

Every function is searched for its largest and for its smallest value. A search is covered when the known
extreme lies no further beyond the worst run than the stated gap. The functions of the gallery are joined by
functions that no choice of the search was made on: a circuit (Ben-Ari and Steinberg 2007), a wing (Forrester,
Sobester and Keane 2008), Friedman 1983, Ishigami and Homma 1990, and standard test functions of optimisation
with many local extremes (Ackley, Levy, Shekel, Michalewicz, Rosenbrock, Styblinski and Tang, the six-hump
camel). Shekel's needles cannot be covered by any model of few runs; they are in the count.

`python -m studies.worst_case_calibration 0 3` prints one line per search for seeds 0, 1, 2, then the totals.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from studies.asked_range import asked_range
from studies.welch20 import welch20
from studies.worst_case_gallery import (
    BOREHOLE,
    PISTON,
    PROBLEMS,
    borehole,
    branin,
    goldstein_price,
    hartmann3,
    hartmann6,
    piston,
)
from workbench import Parameter, Space
from workbench.search.worst_case import worst_case

__all__ = ["FUNCTIONS", "Extremes", "Search", "run", "searches"]

COVERED = 1e-6  # of the range: what a known extreme itself may be off


@dataclass(frozen=True, slots=True, kw_only=True)
class Extremes:
    """A function over its box with its smallest and largest value."""

    name: str
    function: Callable[..., float]
    space: Space
    low: float
    high: float


def _box(names: Sequence[str], *bounds: tuple[float, float]) -> Space:
    lows_highs = bounds if len(bounds) > 1 else bounds * len(names)
    return Space([Parameter(n, lower=lo, upper=hi) for n, (lo, hi) in zip(names, lows_highs, strict=True)])


def _cube(count: int, lower: float, upper: float) -> Space:
    return _box([f"x{i}" for i in range(1, count + 1)], (lower, upper))


def _vector(function: Callable[[np.ndarray], float]) -> Callable[..., float]:
    return lambda **x: float(function(np.array(list(x.values()), dtype=float)))


def otl_circuit(*, Rb1: float, Rb2: float, Rf: float, Rc1: float, Rc2: float, beta: float) -> float:
    """Midpoint voltage of a push-pull circuit, V; resistances in kilo-ohm."""
    gain = beta * (Rc2 + 9)
    base = 12 * Rb2 / (Rb1 + Rb2) + 0.74
    return base * gain / (gain + Rf) + 11.35 * Rf / (gain + Rf) + 0.74 * Rf * gain / ((gain + Rf) * Rc1)


def wing_weight(
    *, Sw: float, Wfw: float, A: float, sweep: float, q: float, taper: float, tc: float, Nz: float,
    Wdg: float, Wp: float,
) -> float:  # fmt: skip
    """Weight of a light aircraft's wing, lb; sweep in degrees."""
    cosine = np.cos(np.radians(sweep))
    shape = (A / cosine**2) ** 0.6 * q**0.006 * taper**0.04 * (100 * tc / cosine) ** -0.3
    return float(0.036 * Sw**0.758 * Wfw**0.0035 * shape * (Nz * Wdg) ** 0.49 + Sw * Wp)


def _ackley(x: np.ndarray) -> float:
    ripple = np.exp(np.cos(2 * np.pi * x).mean())
    return float(-20 * np.exp(-0.2 * np.sqrt((x**2).mean())) - ripple + 20 + np.e)


def _levy(x: np.ndarray) -> float:
    w = 1 + (x - 1) / 4
    middle = ((w[:-1] - 1) ** 2 * (1 + 10 * np.sin(np.pi * w[:-1] + 1) ** 2)).sum()
    return float(np.sin(np.pi * w[0]) ** 2 + middle + (w[-1] - 1) ** 2 * (1 + np.sin(2 * np.pi * w[-1]) ** 2))


_SHEKEL_B = 0.1 * np.array([1, 2, 2, 4, 4, 6, 3, 7, 5, 5])
_ODD, _EVEN = [4, 1, 8, 6, 3, 2, 5, 8, 6, 7], [4, 1, 8, 6, 7, 9, 3, 1, 2, 3.6]
_SHEKEL_C = np.array([_ODD, _EVEN, _ODD, _EVEN]).T


def _shekel(x: np.ndarray) -> float:
    return float(-(1 / (((x - _SHEKEL_C) ** 2).sum(axis=1) + _SHEKEL_B)).sum())


def _michalewicz(x: np.ndarray) -> float:
    i = np.arange(1, len(x) + 1)
    return float(-(np.sin(x) * np.sin(i * x**2 / np.pi) ** 2).sum())


def _camel(x: np.ndarray) -> float:
    a, b = x
    return float((4 - 2.1 * a**2 + a**4 / 3) * a**2 + a * b + (4 * b**2 - 4) * b**2)


def _rosenbrock(x: np.ndarray) -> float:
    return float((100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum())


def _styblinski(x: np.ndarray) -> float:
    return float(0.5 * (x**4 - 16 * x**2 + 5 * x).sum())


def _friedman(x: np.ndarray) -> float:
    return float(10 * np.sin(np.pi * x[0] * x[1]) + 20 * (x[2] - 0.5) ** 2 + 10 * x[3] + 5 * x[4])


def _ishigami(x: np.ndarray) -> float:
    return float(np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0]))


_SPACES = {p.name: p.space for p in PROBLEMS}
_CIRCUIT = _box(
    ("Rb1", "Rb2", "Rf", "Rc1", "Rc2", "beta"),
    (50, 150), (25, 70), (0.5, 3), (1.2, 2.5), (0.25, 1.2), (50, 300),
)  # fmt: skip
_WING = _box(
    ("Sw", "Wfw", "A", "sweep", "q", "taper", "tc", "Nz", "Wdg", "Wp"),
    (150, 200), (220, 300), (6, 10), (-10, 10), (16, 45), (0.5, 1), (0.08, 0.18), (2.5, 6), (1700, 2500),
    (0.025, 0.08),
)  # fmt: skip


def _known(name: str, function: Callable[..., float], space: Space, low: float, high: float) -> Extremes:
    return Extremes(name=name, function=function, space=space, low=low, high=high)


# extremes by multistart from 8192 Sobol' points and all corners, refined by L-BFGS-B
FUNCTIONS = (
    _known("borehole", borehole, BOREHOLE, 7.8196763, 309.5755877),
    _known("piston", piston, PISTON, 0.1642288, 1.1990112),
    _known("welch20", welch20, _SPACES["welch20"], -8.25, 13.3125),
    _known("branin", branin, _SPACES["branin"], 0.397887, 308.1290960),
    _known("goldstein_price", goldstein_price, _SPACES["goldstein_price"], 3.0, 1015690.2718),
    _known("hartmann3", hartmann3, _SPACES["hartmann3"], -3.862782, -3.7727e-5),
    _known("hartmann6", hartmann6, _SPACES["hartmann6"], -3.322368, 0.0),
    _known("circuit", otl_circuit, _CIRCUIT, 2.6037148, 9.6013426),
    _known("wing", wing_weight, _WING, 123.2536717, 517.6650490),
    _known("ackley3", _vector(_ackley), _cube(3, -5, 8), 0.0, 17.9142965),
    _known("levy4", _vector(_levy), _cube(4, -10, 10), 0.0, 254.8984269),
    _known("shekel", _vector(_shekel), _cube(4, 0, 10), -10.5364432, -0.0809114),
    _known("michalewicz3", _vector(_michalewicz), _cube(3, 0, np.pi), -2.8028481, 0.0),
    _known("camel", _vector(_camel), _box(("x1", "x2"), (-3, 3), (-2, 2)), -1.0316285, 162.9),
    _known("rosenbrock4", _vector(_rosenbrock), _cube(4, -2, 2), 0.0, 10827.0),
    _known("styblinski3", _vector(_styblinski), _cube(3, -5, 5), -117.4984971, 375.0),
    _known("friedman5", _vector(_friedman), _cube(5, 0, 1), 0.0, 30.0),
    _known("ishigami", _vector(_ishigami), _cube(3, -np.pi, np.pi), -10.7409091, 17.7409091),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """One search; gaps are shares of the function's range."""

    case: str
    seed: int
    true_gap: float
    stated_gap: float
    evaluations: int

    @property
    def is_covered(self) -> bool:
        """Whether the known extreme lies within the stated gap."""
        return self.true_gap <= self.stated_gap + COVERED


def searches(
    seeds: Sequence[int] = (0,), *, budget: int = 50, functions: Sequence[Extremes] = FUNCTIONS
) -> Iterator[Search]:
    """Search both extremes of every function with every seed."""
    for seed in seeds:
        for f in functions:
            for sense, known in (("max", f.high), ("min", f.low)):
                found = worst_case(f.function, f.space, sense=sense, budget=budget, seed=seed)
                yield Search(
                    case=f"{f.name} {sense}",
                    seed=seed,
                    true_gap=abs(known - found.value) / (f.high - f.low),
                    stated_gap=found.gap.width / (f.high - f.low),
                    evaluations=found.evaluations,
                )


def run(
    seeds: Sequence[int] = (0,), *, budget: int = 50, functions: Sequence[Extremes] = FUNCTIONS
) -> xr.Dataset:
    """All searches as a dataset; `coverage` and `width` (median stated gap) are its attributes."""
    made = list(searches(seeds, budget=budget, functions=functions))
    columns = ("true_gap", "stated_gap", "evaluations")
    return xr.Dataset(
        {name: ("search", np.array([getattr(s, name) for s in made])) for name in columns},
        coords={"case": ("search", [s.case for s in made]), "seed": ("search", [s.seed for s in made])},
        attrs={"budget": budget, "coverage": _coverage(made), "width": _width(made)},
    )


def _coverage(made: Sequence[Search]) -> float:
    return float(np.mean([s.is_covered for s in made]))


def _width(made: Sequence[Search]) -> float:
    return float(np.median([s.stated_gap for s in made]))


if __name__ == "__main__":
    done: list[Search] = []
    for s in searches(asked_range(sys.argv[1:])):
        done.append(s)
        word = "" if s.is_covered else "   not covered"
        gaps = f"true {s.true_gap:.1e}   stated {s.stated_gap:.1e}"
        print(f"{s.case:20s} seed {s.seed:3d}   {gaps}{word}", flush=True)
    print(f"{len(done)} searches, {_coverage(done):.1%} covered, median gap {_width(done):.2%} of the range")

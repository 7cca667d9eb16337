"""The worst case of models with noise: bias of the stated mean, coverage of its interval, width of its gap.

Ten functions with both extremes known, 2 to 10 inputs, get normal noise of a tenth of their range. Counted
are, in units of the noise or of the range:

    bias       stated mean less the true mean at the reported point, over the noise
    held       share of the intervals that hold that true mean
    lucky      the same for the largest of all runs, which a search without repeats would report
    short      largest mean over the box less the mean at the reported point, over the range
    gap        stated gap over the range, and the share of gaps that the largest mean does not exceed

`python -m studies.noisy_worst_case 0 10` prints a line per function for seeds 0 to 9, with the runs that a
search makes which is told of noise; `python -m studies.noisy_worst_case 0 10 60` with 60 runs; and
`python -m studies.noisy_worst_case undeclared 0.03 0 10` what becomes of noise of 3 % of the range of which
nobody says anything: how often it is `found`, and the bias of what is reported, a mean or a single run.
"""

import sys
from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from studies.asked_range import asked_range
from studies.worst_case_calibration import FUNCTIONS, Extremes
from workbench.search.arguments import default_budget
from workbench.search.worst_case import worst_case

__all__ = ["CASES", "NOISE", "asked_budget", "run", "run_undeclared"]

NOISE = 0.1  # standard deviation of a run, of the range of the function
CASES = (
    ("branin", "max"), ("camel", "max"), ("ishigami", "min"), ("hartmann3", "min"), ("styblinski3", "max"),
    ("friedman5", "min"), ("circuit", "max"), ("piston", "max"), ("borehole", "max"), ("wing", "min"),
)  # fmt: skip


def _noisy(f: Extremes, seed: int, noise: float) -> Callable[..., float]:
    """The function with normal noise, a share of its range."""
    deviation = noise * (f.high - f.low)
    rng = np.random.default_rng([seed, len(f.name), ord(f.name[0])])
    return lambda **x: float(f.function(**x) + deviation * rng.standard_normal())


def _searched(f: Extremes, sense: str, seed: int, budget: int | None) -> tuple[float, ...]:
    size, noisy = f.high - f.low, _noisy(f, seed, NOISE)
    found = worst_case(noisy, f.space, sense=sense, budget=budget, seed=seed, noise=True)
    sign, top = (1.0, f.high) if sense == "max" else (-1.0, f.low)
    true = f.function(**found.parameters)
    assert found.interval is not None
    lucky = max(found.runs, key=lambda run: sign * (run.value if run.value is not None else -sign * np.inf))
    return (
        sign * (found.value - true) / (NOISE * size),
        float(found.interval[0] <= true <= found.interval[1]),
        sign * (float(lucky.value or 0.0) - f.function(**lucky.parameters)) / (NOISE * size),
        sign * (top - true) / size,
        found.gap.width / size,
        float(sign * top <= sign * found.gap.upper),
    )


def run(
    seeds: Sequence[int] = (0,), *, budget: int | None = None, cases: Sequence[tuple[str, str]] = CASES
) -> xr.Dataset:
    """Every case with every seed; variables over (case, seed) as above.

    budget: None for what a search makes that is told of noise.
    """
    known = {f.name: f for f in FUNCTIONS}
    made = np.array(
        [[_searched(known[name], sense, seed, budget) for seed in seeds] for name, sense in cases]
    )
    names = ("bias", "held", "lucky", "short", "gap", "covered")
    return xr.Dataset(
        {name: (("case", "seed"), made[:, :, k]) for k, name in enumerate(names)},
        coords={"case": [f"{name} {sense}" for name, sense in cases], "seed": list(seeds)},
        attrs={"budget": default_budget(True) if budget is None else budget, "noise": NOISE},
    )


def asked_budget(words: Sequence[str]) -> int | None:
    """The runs of a search as a command line gives them, None without.

    Raises SystemExit, which ends the command with its message: not a whole number of runs.
    """
    if words and not words[0].isdecimal():
        raise SystemExit(f"the runs of a search need a whole number after FIRST LAST, got {words[0]}")
    return int(words[0]) if words else None


def run_undeclared(
    noise: float, seeds: Sequence[int] = (0,), *, budget: int = 60, cases: Sequence[tuple[str, str]] = CASES
) -> xr.Dataset:
    """Every case with every seed where nobody says that there is `noise`: whether it was `found`, and the
    `bias` of the value reported, over the noise.
    """
    known = {f.name: f for f in FUNCTIONS}
    made = np.empty((len(cases), len(seeds), 2))
    for i, (name, sense) in enumerate(cases):
        f, sign = known[name], 1.0 if sense == "max" else -1.0
        for j, seed in enumerate(seeds):
            found = worst_case(_noisy(f, seed, noise), f.space, sense=sense, budget=budget, seed=seed)
            off = sign * (found.value - f.function(**found.parameters))
            made[i, j] = found.repeated is not None, off / (noise * (f.high - f.low))
    return xr.Dataset(
        {name: (("case", "seed"), made[:, :, k]) for k, name in enumerate(("found", "bias"))},
        coords={"case": [f"{name} {sense}" for name, sense in cases], "seed": list(seeds)},
        attrs={"budget": budget, "noise": noise},
    )


if __name__ == "__main__" and sys.argv[1:2] == ["undeclared"]:
    told = run_undeclared(float(sys.argv[2]), asked_range(sys.argv[3:]))
    for case in told["case"].values:
        found, bias = (float(told[name].sel(case=case).mean()) for name in ("found", "bias"))
        print(f"{case:16s} found {found:4.0%}   bias {bias:.2f}")
    print(
        f"{told['bias'].size} searches: found {float(told['found'].mean()):.0%}, bias "
        f"{float(told['bias'].mean()):.2f}"
    )
elif __name__ == "__main__":
    seeds, runs = asked_range(sys.argv[1:]), asked_budget(sys.argv[3:])
    parts = []
    for case in CASES:
        part = run(seeds, budget=runs, cases=(case,))
        parts.append(part)
        words = ", ".join(f"{name} {float(part[name].mean()):.3f}" for name in part.data_vars)
        print(f"{case[0]:12s} {case[1]}   {words}   gap {float(part['gap'].median()):.3f}", flush=True)
    every = xr.concat(parts, "case")
    print(
        f"{every['bias'].size} searches: bias {float(every['bias'].mean()):.2f} (of the luckiest run "
        f"{float(every['lucky'].mean()):.2f}), interval holds {float(every['held'].mean()):.1%}, median gap "
        f"{float(every['gap'].median()):.1%}, covered {float(every['covered'].mean()):.1%}"
    )

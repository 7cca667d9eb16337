"""Tables 3.1 and 3.2 of the dissertation beside the forward screening of other samples.

Chapter III prints two screening paths of Welch's function, one from an IHS and one from a D-optimal sample,
and not how many runs they had. The first step says it: for every size a line is fitted to l over log theta_S
of many samples, and read at the printed theta_S. The same for sigma.

    python -m studies.printed_screening_tables
"""

import numpy as np
import pandas as pd

from studies.sampler_question import SAMPLERS
from studies.screening_functions import FUNCTIONS
from surrogates import KrigingScreener, ScreeningStep
from workbench.space.streams import stream

__all__ = ["PRINTED", "first_steps", "successful_path"]

# first line of the tables: common theta, "sigma^2", l
PRINTED = {"ihs": (0.3883, 2.2305, -50.1679), "d_optimal": (0.1359, 2.6261, -54.5434)}
WELCH = FUNCTIONS["welch"]


def _path(sampler: str, n: int, replicate: int, *, steps: int | None, seed: int) -> list[ScreeningStep]:
    x = np.asarray(SAMPLERS[sampler](n, stream(seed, f"sample {sampler} {n}", replicate=replicate)))
    # the common theta is printed for the cube [-1/2, 1/2]
    return KrigingScreener(method="forward", n_features=steps).fit(x - 0.5, WELCH.evaluate(x)).path_


def first_steps(sampler: str, n: int, *, samples: int = 40, seed: int = 3) -> dict[str, float]:
    """l and sigma of the first step at the printed theta_S, from a line over log theta_S; spread of l about
    it."""
    steps = [_path(sampler, n, r, steps=1, seed=seed)[0] for r in range(samples)]
    printed, _, _ = PRINTED[sampler]
    away = np.log([max(s.theta_common, 1e-6) for s in steps]) - np.log(printed)
    lines = np.column_stack([np.ones(samples), away])
    l = np.array([s.log_likelihood for s in steps])
    at, *_ = np.linalg.lstsq(lines, l, rcond=None)
    sigma, *_ = np.linalg.lstsq(lines, 0.5 * np.log([s.sigma2 for s in steps]), rcond=None)
    return {
        "l": float(at[0]),
        "spread": float(np.std(l - lines @ at, ddof=2)),
        "sigma": float(np.exp(sigma[0])),
    }


def successful_path(sampler: str, *, n: int = 50, most: int = 200, seed: int = 3) -> list[ScreeningStep]:
    """The path of the first sample from which the forward search selects exactly the six; empty if none."""
    for replicate in range(most):
        path = _path(sampler, n, replicate, steps=None, seed=seed)
        if {k for s in path if s.accepted for k in s.added} == set(WELCH.active):
            return path
    return []


def main() -> None:
    """Print both."""
    rows = [{"sampler": s, "n": n, **first_steps(s, n)} for s in PRINTED for n in (40, 50, 64)]
    print(pd.DataFrame(rows).round(2).to_string(index=False))
    for sampler in PRINTED:
        print(f"\n{sampler}: selected, common theta, sigma^2, l")
        for step in successful_path(sampler):
            names = ", ".join(str(k + 1) for k in step.selected)
            print(f"{names:28s} {step.theta_common:8.4f} {step.sigma2:10.4f} {step.log_likelihood:9.4f}")


if __name__ == "__main__":
    main()

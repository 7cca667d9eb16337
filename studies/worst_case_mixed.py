"""Worst cases of the kinds that campaigns bring: switches and forces with failing runs, a rough grid, reused
screening runs.

    switches    six switches and four continuous factors; the solver diverges in about a tenth of the box
    grip        51 grip strengths in steps of 7 N, a hump with 4 % of roughness that repeats from run to run
    stiffness   eight joint stiffness factors, 64 screening runs given, the worst case is a corner

The true worst case of each is known by enumeration: all combinations of switches with a fine search inside,
all 51 grid points, all 256 corners. `run(seed)` counts the true runs that our search needs;
`python -m studies.worst_case_mixed` prints the table.
"""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

import doe
from workbench import Parameter, Space
from workbench.search.worst_case import WorstCase, worst_case

__all__ = [
    "GRIP", "STIFFNESS", "SWITCHES", "grip_response", "grip_worst", "run", "search_grip", "search_stiffness",
    "search_switches", "stiffness_response", "stiffness_worst", "switches_fails", "switches_response",
    "switches_worst",
]  # fmt: skip

SWITCH_NAMES = ("belt", "airbag", "left_hand", "right_hand", "headrest", "turret")
SWITCHES = Space(
    [
        *(Parameter(name, kind="binary") for name in SWITCH_NAMES),
        Parameter("speed", lower=20, upper=60, unit="km/h"),
        Parameter("friction", lower=0.2, upper=0.9),
        Parameter("slack", lower=0, upper=80, unit="mm"),
        Parameter("mass", lower=60, upper=110, unit="kg"),
    ]
)
GRIP = Space([Parameter("grip", lower=350, upper=700, step=7, unit="N")])
JOINTS = ("shoulder_x", "shoulder_y", "shoulder_z", "elbow", "wrist", "hip", "knee", "neck")
STIFFNESS = Space([Parameter(name, lower=0.5, upper=2.0) for name in JOINTS])
SCREENING_RUNS = 64
ROUGHNESS = 0.04  # of the hump's height


def switches_fails(row: Mapping[str, Any]) -> bool:
    """Whether the solver diverges: light bodies on a gripping road at speed, a tenth of the box."""
    speed, friction = (row["speed"] - 20) / 40, (row["friction"] - 0.2) / 0.7
    return bool(speed + friction - 0.6 * (row["mass"] - 60) / 50 > 1.26)


def switches_response(**row: Any) -> float:
    """A peak excursion in mm with two-switch interactions, which turn the sign of continuous factors.

    Raises:
        FloatingPointError: where the solver diverges.
    """
    if switches_fails(row):
        raise FloatingPointError("step size fell below 1e-9 s")
    belt, airbag, left, right, rest, turret = (float(row[name]) for name in SWITCH_NAMES)
    s, f = (row["speed"] - 20) / 40, (row["friction"] - 0.2) / 0.7
    k, m = row["slack"] / 80, (row["mass"] - 60) / 50
    pull = s * (1.3 - 0.6 * f) * (1 + 0.4 * m)
    held = 0.45 * belt * (1 - 0.7 * k) + 0.25 * airbag * (1 - 1.2 * belt)
    held += 0.2 * (left + right - left * right)
    sway = 0.35 * turret * np.sin(3.0 * s) * (1 - right) + 0.15 * rest * (m - 0.5) * (1 - 2 * airbag)
    return 100.0 * float(pull - held + sway + 0.25 * k * belt * turret)


def switches_worst() -> float:
    """The largest response where runs succeed: all 64 combinations, each refined from a fine sample."""
    rng = np.random.default_rng(7)
    names = ("speed", "friction", "slack", "mass")
    low, width = np.array([20, 0.2, 0, 60]), np.array([40, 0.7, 80, 50])
    sample = np.vstack([rng.random((400, 4)), np.array(list(product((0.0, 1.0), repeat=4)))])
    worst = -np.inf
    for combination in product((0, 1), repeat=6):
        fixed = dict(zip(SWITCH_NAMES, combination, strict=True))

        def negative(u: np.ndarray, fixed: dict[str, int] = fixed) -> float:
            row = {**fixed, **dict(zip(names, low + np.clip(u, 0, 1) * width, strict=True))}
            return 1e3 if switches_fails(row) else -switches_response(**row)

        values = np.array([negative(u) for u in sample])
        for start in sample[np.argsort(values)[:3]]:
            options = {"maxiter": 400, "xatol": 1e-6, "fatol": 1e-8}
            found = minimize(negative, start, method="Nelder-Mead", options=options)  # type: ignore[call-overload]
            worst = max(worst, -found.fun)
    return float(worst)


def grip_response(grip: float, *, draw: int = 0) -> float:
    """Peak force in N against grip strength: a hump of 10 kN over a slope, and roughness that repeats.

    `draw` chooses the hump's place and the roughness.
    """
    rng = np.random.default_rng((draw, 51))
    place, width = rng.uniform(0.05, 0.95), rng.uniform(0.12, 0.25)
    rough = rng.standard_normal(51) * ROUGHNESS
    u = (grip - 350.0) / 350.0
    hump = np.exp(-0.5 * ((u - place) / width) ** 2)
    return float(1e4 * (hump + 0.3 * u + rough[round(50 * u)]))


def grip_worst(draw: int = 0) -> float:
    """The largest of the 51 values."""
    return max(grip_response(float(g), draw=draw) for g in np.linspace(350, 700, 51))


def stiffness_response(**row: float) -> float:
    """Rotation of a joint in mrad: two strong factors, two weak ones, an interaction, four almost inert."""
    log = {name: np.log2(value) for name, value in row.items()}  # -1 .. 1
    strong = 9 * log["shoulder_x"] - 5 * log["wrist"] + 3 * log["shoulder_x"] * log["wrist"]
    weak = 1.5 * log["elbow"] ** 2 - 1.2 * log["hip"] * log["elbow"]
    inert = sum(0.05 * log[name] for name in ("shoulder_y", "shoulder_z", "knee", "neck"))
    return float(40.0 * np.exp(0.08 * (strong + weak)) + inert)


def stiffness_worst() -> float:
    """The largest of the 256 corners."""
    corners = product((0.5, 2.0), repeat=len(JOINTS))
    return max(stiffness_response(**dict(zip(JOINTS, corner, strict=True))) for corner in corners)


def search_switches(seed: int, *, budget: int = 120) -> WorstCase:
    """The worst case over switches and forces."""
    return worst_case(switches_response, SWITCHES, budget=budget, seed=seed)


def search_grip(seed: int, *, draw: int = 0, budget: int = 15) -> WorstCase:
    """The worst grip strength."""
    return worst_case(lambda grip: grip_response(grip, draw=draw), GRIP, budget=budget, seed=seed)


def search_stiffness(seed: int, *, budget: int = 16) -> WorstCase:
    """The worst corner, from 64 space-filling runs as a screening leaves them."""
    u = doe.optimised_lhs(
        SCREENING_RUNS, len(JOINTS), criterion="phi_p", swaps=20_000, rng=np.random.default_rng(seed)
    )
    start = [{**row, "y": stiffness_response(**row)} for row in STIFFNESS.rows(u)]
    return worst_case(stiffness_response, STIFFNESS, budget=budget, seed=seed, start=start)


def _runs_until(found: WorstCase, value: float, share: float) -> float:
    """True runs of the search, failures included, until within `share` of `value`; NaN when never."""
    for run_ in found.runs:
        if run_.number and run_.value is not None and run_.value >= value - share * abs(value):
            return float(run_.number)
    return float("nan")


def run(seed: int = 0, *, share: float = 0.01) -> xr.Dataset:
    """Search all three once: true runs until the worst is met (to `share`; the grip's exactly), and gaps."""
    cases = {
        "switches": (search_switches(seed), switches_worst(), share),
        "grip": (search_grip(seed, draw=seed), grip_worst(seed), 0.0),
        "stiffness": (search_stiffness(seed), stiffness_worst(), share),
    }
    columns: dict[str, list[float]] = {
        "runs_to_worst": [_runs_until(*case) for case in cases.values()],
        "found": [found.value for found, _, _ in cases.values()],
        "known": [value for _, value, _ in cases.values()],
        "failed": [float(sum(found.failures.values())) for found, _, _ in cases.values()],
        "stated_gap": [found.gap.width for found, _, _ in cases.values()],
    }
    return xr.Dataset(
        {name: ("case", np.array(column)) for name, column in columns.items()},
        coords={"case": list(cases)},
        attrs={"seed": seed},
    )


if __name__ == "__main__":
    print(run().to_dataframe().to_string(float_format="%.5g"))

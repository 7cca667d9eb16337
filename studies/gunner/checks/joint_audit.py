"""Which joints decide how far the gunner rises: screening, one at a time, and all 2^8 corners.

    python -m studies.gunner.checks.joint_audit [balanced|torque-free] [seat rate in N/m]

Stiffness factors of the eight joints of Table 8.6 between 1/2 and 2 (scale log), rise of the mass centre
within 1 s of a step of the steering wheel, as in section 8.3 and Table 8.7; both starts and both seats unless
one is named (65 CPU s each).
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

import doe
from surrogates import KrigingScreener, ScreeningStep
from workbench.engine import simulate

from ..cases import system
from ..figure_numbers import JOINTS
from ..occupant_responses import objectives
from ..uncertain import TIMES, case_of

__all__ = [
    "COMBINATIONS",
    "Audit",
    "Shares",
    "audit",
    "lines",
    "main",
    "one_at_a_time",
    "path_lines",
    "rise",
    "shares",
]

Array = np.ndarray[Any, Any]
STEP = 2e-3  # s: moves no rise of the audit by more than 0.02 mm, see `main`
RUNS, SEED = 64, 1  # of the screening
COMBINATIONS = tuple(product(("balanced", "torque-free"), (10_000.0, 20_000.0)))  # start, seat rate N/m


def rise(row: Mapping[str, Any], *, step: float = STEP) -> float:
    """Highest rise of the mass centre in a step steer, m."""
    ground, t_end = "step steer", TIMES["step steer"]
    run = simulate(system(case_of(ground, row)), np.zeros(0), t_end, round(t_end / step))
    return float(objectives(run.system, t_end=t_end)["rise"].value(run))


def row_of(point: Any) -> dict[str, float]:
    """Factors of a point of the cube [-1, 1]^8: 2 to the power of its coordinates."""
    return {f"k_{joint}": float(2.0**x) for joint, x in zip(JOINTS, point, strict=True)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Shares:
    """What the 2^k corners say of every factor: shares of their variance.

    main, total: (k,) the factor alone, and with all that it interacts in. effect: (k,) mean change from its
    lower to its upper level, unit of the response.
    """

    main: Array
    total: Array
    effect: Array


def shares(values: Array) -> Shares:
    """Shares of the corners' variance, by contrasts.

    values: (2^k,) in the order of `itertools.product((-1, 1), repeat=k)`, the last factor fastest.

    >>> found = shares(np.array([a + 0.5 * b + 0.1 * a * b for a in (-1, 1) for b in (-1, 1)]))
    >>> found.effect
    array([2., 1.])
    >>> np.round(found.total * 1.26, 3)
    array([1.01, 0.26])
    """
    k = int(np.log2(len(values)))
    contrasts = np.asarray(values, float).reshape((2,) * k)
    for axis in range(k):
        low, high = np.take(contrasts, 0, axis), np.take(contrasts, 1, axis)
        contrasts = np.stack([low + high, high - low], axis) / 2.0
    squares = contrasts**2
    whole = squares.sum() - squares.flat[0]
    alone = [squares[tuple(int(i == j) for i in range(k))] for j in range(k)]
    with_others = [np.take(squares, 1, axis=j).sum() for j in range(k)]
    effect = [2.0 * contrasts[tuple(int(i == j) for i in range(k))] for j in range(k)]
    return Shares(main=np.array(alone) / whole, total=np.array(with_others) / whole, effect=np.array(effect))


def one_at_a_time(response: Callable[[Any], float], k: int) -> tuple[float, Array]:
    """The nominal response, and (k, 2) its changes with each factor at its lower and upper level."""
    base = response(np.zeros(k))
    changes = [[response(side * np.eye(k)[j]) - base for side in (-1.0, 1.0)] for j in range(k)]
    return base, np.array(changes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Audit:
    """Corners, single changes and screening of one start and seat."""

    base: float
    single: Array
    corners: Array
    all_corners: Shares
    printed_path: tuple[ScreeningStep, ...]
    selected: tuple[int, ...]


def audit(response: Callable[[Any], float], k: int, *, runs: int = RUNS, seed: int = SEED) -> Audit:
    """All three ways on a response over [-1, 1]^k.

    The path is that of the published search, in the form of Table 8.7; `selected` is what the default method
    of the same runs selects.
    """
    base, single = one_at_a_time(response, k)
    corners = np.array([response(corner) for corner in product((-1.0, 1.0), repeat=k)])
    cube = doe.optimised_lhs(runs, k, rng=np.random.default_rng(seed))
    values = np.array([response(2.0 * point - 1.0) for point in cube])
    path = KrigingScreener(method="forward").fit(cube - 0.5, values).path_
    chosen = KrigingScreener().fit(cube - 0.5, values).selected_
    return Audit(
        base=base, single=single, corners=corners, all_corners=shares(corners), printed_path=tuple(path),
        selected=tuple(int(j) for j in chosen),
    )  # fmt: skip


def path_lines(path: Sequence[ScreeningStep]) -> list[str]:
    """The lines of Table 8.7: selected, (theta of the others, sigma^2), l; in brackets beyond the cut."""
    lines = []
    for step in path:
        numbers = f"({step.theta_common:.4f}, {step.sigma2:.4g})  {step.log_likelihood:9.4f}"
        line = f"{_numbers(step.selected):18} {numbers}"
        lines.append(line if step.accepted else f"[{line}]")
    return lines


def lines(found: Audit) -> list[str]:
    """A row for every joint, mm and %, then the three orders."""
    s = found.all_corners
    out = [
        f"rise {1e3 * found.base:.2f} mm, corners {1e3 * found.corners.min():.2f} to "
        f"{1e3 * found.corners.max():.2f} mm",
        "     joint         one at a time: x 1/2, x 2 mm     corners: effect mm   alone %   total %",
    ]
    for j, joint in enumerate(JOINTS):
        low, high = 1e3 * found.single[j]
        out.append(
            f"x{j + 1}   {joint:14} {low:16.3f} {high:10.3f} {1e3 * s.effect[j]:22.3f} "
            f"{100 * s.main[j]:9.2f} {100 * s.total[j]:9.2f}"
        )
    single, corners = (np.argsort(-size) for size in (np.abs(found.single).max(axis=1), s.total))
    out += [
        f"order one at a time {_numbers(single)}; of the corners {_numbers(corners)}; the default screening "
        f"selects {_numbers(found.selected)}; path of the published search:",
        *path_lines(found.printed_path),
    ]
    return out


def _numbers(joints: Any) -> str:
    return ",".join(str(int(j) + 1) for j in joints)


def main() -> None:
    """Print every start and seat."""
    wanted = COMBINATIONS if len(sys.argv) < 3 else ((sys.argv[1], float(sys.argv[2])),)
    for start, seat in wanted:
        choice = {"start": start, "seat_rate": seat}

        def response(point: Any, choice: Mapping[str, Any] = choice) -> float:
            return rise({**choice, **row_of(point)})

        found = audit(response, len(JOINTS))
        finer = rise(choice, step=0.5 * STEP)
        change = 1e3 * (finer - found.base)
        print(f"\n{start}, seat {seat / 1e3:g} kN/m; half the step changes the rise by {change:.3f} mm")
        print("\n".join(lines(found)), flush=True)


if __name__ == "__main__":
    main()

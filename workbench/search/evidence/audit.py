"""What was really run around a worst case: corners, combinations, monotonicity, and which factors it moved.

The reader of a worst case asks three things that the number alone does not answer: which corners of the box
were true runs and which does the Kriging still hold open; is the worst a corner because the response is
monotone; and which combinations of discrete factors were tried.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from workbench.search.evidence.certificates import failed_points
from workbench.search.evidence.combinations import combinations_tried
from workbench.search.evidence.gap import BOUND_FACTOR, Gap
from workbench.search.runs.ledger import Ledger, Run, distinct
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.model import SearchModel
from workbench.space.units import counted

__all__ = ["Audit", "audit_runs"]

PROBES = 200  # points at which the sign of the slope is read
STEP = 0.02  # of the unit cube, for the slope
NO_CORNER = "no corner of the box meets the constraints"
MONOTONE = 0.975  # chance of one sign at every probe that counts as monotone


@dataclass(frozen=True, slots=True, kw_only=True)
class Audit:
    """Counts of corners, evidence of monotonicity per parameter, combinations with their bounds.

    `corners` is None when there are too many to count out (more than 4096). `corners_open` are corners that
    were not run and whose upper bound exceeds the worst run. `monotone` maps a parameter to "rising",
    "falling" or "mixed" in the response's own sign, `monotone_share` to the share of probes where that sign
    is credible. `gradient_signs` are the same words from the model's own gradients at `gradient_runs` runs.
    """

    corners: int | None
    corners_run: int
    corners_open: int | None
    is_corner: bool
    monotone: Mapping[str, str] = field(default_factory=dict)
    monotone_share: Mapping[str, float] = field(default_factory=dict)
    combinations: tuple[Mapping[str, Any], ...] = ()
    corner_consistent: bool = False
    gradient_signs: Mapping[str, str] = field(default_factory=dict)
    gradient_runs: int = 0
    corners_failed: int = 0

    def to_dict(self) -> dict[str, Any]:
        """For the JSON document."""
        return {**asdict(self), "sentences": self.sentences}

    @property
    def sentences(self) -> list[str]:
        """What to tell a reader."""
        out = []
        failed = f"; {self.corners_failed} more failed and may be worse" if self.corners_failed else ""
        if self.corners is None:
            corners = counted(self.corners_run, "corner was", "corners were")
            out.append(f"{corners} run; there are too many to run them all{failed}")
        elif self.corners_run == self.corners:
            out.append(f"all {self.corners} corners were run" if self.corners else NO_CORNER)
        elif self.corners_run + self.corners_failed == self.corners:
            out.append(f"{self.corners_run} of {self.corners} corners gave a value{failed}")
        else:
            out.append(
                f"{self.corners_run} of {self.corners} corners were run; by the Kriging "
                f"{self.corners_open or 'none'} of the others may be worse{failed}"
            )
        if self.corner_consistent:
            out.append(
                "the worst run is the corner that the signs of all slopes point to (monotone, model-based)"
            )
        if self.gradient_runs:
            one = [name for name, word in self.gradient_signs.items() if word != "mixed"]
            several = [name for name, word in self.gradient_signs.items() if word == "mixed"]
            text = f"the model's own gradients at {self.gradient_runs} runs have one sign for "
            text += ", ".join(one) or "no parameter"
            out.append(text + (f" and both signs for {', '.join(several)}" if several else ""))
        open_combinations = [c for c in self.combinations if c["open"]]
        if self.combinations:
            out.append(
                f"{len(self.combinations)} discrete combinations, {len(open_combinations)} of them with an "
                "upper bound above the worst run"
            )
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class _Made:
    """Points of the runs: u (n, d) of those that gave the signed values v (n,), those that failed and never
    gave one, those that `within` excludes, and every one."""

    u: np.ndarray
    v: np.ndarray
    failed: np.ndarray
    excluded: np.ndarray
    every: np.ndarray

    @classmethod
    def of(cls, ledger: Ledger, unseen: Sequence[Run]) -> "_Made":
        """Those of the ledger and of an attack that it does not hold."""
        runs = [*ledger.runs, *unseen]
        added = ledger.where.unit([dict(run.parameters) for run in unseen]) if unseen else ledger.u[:0]
        every = np.vstack([ledger.u, added])
        gave = np.array([run.value is not None for run in runs], dtype=bool)
        excluded = np.array([run.status == "excluded" for run in runs], dtype=bool)
        return cls(
            u=every[gave],
            v=ledger.sign * np.array([run.value for run in runs if run.value is not None]),
            failed=failed_points(ledger.where, every, gave | excluded),
            excluded=every[excluded],
            every=every,
        )


def audit_runs(
    ledger: Ledger,
    model: SearchModel | None,
    *,
    gap: Gap,
    worst: np.ndarray | None = None,
    unseen: Sequence[Run] = (),
    rng: np.random.Generator,
) -> Audit:
    """Audit the runs of a search; `model` is None where too few gave a value for a Kriging.

    `gap`: what is stated of the whole space, in the sign of the ledger. `worst`: the point (d,) that is
    reported, where it is not that of the worst run. `unseen`: runs of an attack, not in the ledger.
    """
    where, runs = ledger.where, _Made.of(ledger, unseen)
    incumbent = ledger.incumbent if worst is None else worst
    corners = where.corners()
    corners_open = None
    if corners is not None:
        corners = corners[where.allowed(corners)]
        left = distinct(corners, runs.every)
        bounds = np.empty(0)
        if len(left) and model is not None:
            bounds = (model.cautious or model).bound(where.features(left), BOUND_FACTOR)
        corners_open = int((bounds > runs.v.max()).sum())
    monotone, share, towards = _monotonicity(where, model, sign=ledger.sign, rng=rng)
    numeric = [j for j, word in enumerate(towards) if word != 0]
    consistent = len(numeric) == where.dimension and all(
        abs(incumbent[j] - (1.0 if towards[j] * ledger.sign > 0 else 0.0)) < 1e-9 for j in numeric
    )
    slopes = np.array(list(ledger.slopes.values())).reshape(-1, where.dimension)
    return Audit(
        corners=None if corners is None else len(corners),
        corners_run=_corners_among(where, runs.u),
        corners_open=corners_open,
        corners_failed=_corners_among(where, runs.failed),
        is_corner=_is_corner(where, incumbent),
        monotone=monotone,
        monotone_share=share,
        combinations=()
        if model is None
        else combinations_tried(ledger, model, gap, u=runs.u, v=runs.v, excluded=runs.excluded, rng=rng),
        corner_consistent=consistent,
        gradient_signs=_gradient_signs(where, slopes * ledger.sign) if len(slopes) else {},
        gradient_runs=len(slopes),
    )


def _gradient_signs(where: SearchSpace, slopes: np.ndarray) -> dict[str, str]:
    """Words per continuous parameter from slopes (m, d) in the response's own sign."""
    words = {}
    for name, column, grid in zip(where.space.names, slopes.T, where.levels, strict=True):
        if grid is None:
            words[name] = "rising" if (column >= 0).all() else "falling" if (column <= 0).all() else "mixed"
    return words


def _is_corner(where: SearchSpace, point: np.ndarray) -> bool:
    ends = (np.abs(point) < 1e-9) | (np.abs(point - 1) < 1e-9)
    return bool(np.all(ends | np.array(where.categorical)))


def _corners_among(where: SearchSpace, points: np.ndarray) -> int:
    """Different corners that the constraints allow among the points (n, d)."""
    at = np.array([_is_corner(where, point) for point in points], dtype=bool)
    return len(np.unique(np.round(points[at & where.allowed(points)], 9), axis=0))


def _monotonicity(
    where: SearchSpace, model: SearchModel | None, *, sign: float, rng: np.random.Generator
) -> tuple[dict[str, str], dict[str, float], list[int]]:
    """Words, shares and signs (in the response's own sign) per parameter, from slopes predicted at random."""
    words: dict[str, str] = {}
    shares: dict[str, float] = {}
    signs: list[int] = []
    if model is None:
        return words, shares, [0] * where.dimension
    base = rng.random((PROBES, where.dimension))
    for j, (name, grid) in enumerate(zip(where.space.names, where.levels, strict=True)):
        if where.categorical[j]:
            signs.append(0)
            continue
        low, high = base.copy(), base.copy()
        if grid is None:
            low[:, j], high[:, j] = np.clip(base[:, j] - STEP, 0, 1), np.clip(base[:, j] + STEP, 0, 1)
        else:
            k = np.minimum((base[:, j] * (len(grid) - 1)).astype(int), len(grid) - 2)
            low[:, j], high[:, j] = grid[k], grid[k + 1]
        rise = sign * (
            model.predict(where.features(where.snap(high)))[0]
            - model.predict(where.features(where.snap(low)))[0]
        )
        up, down = float((rise > 0).mean()), float((rise < 0).mean())
        shares[name] = max(up, down)
        word = "rising" if up >= MONOTONE else "falling" if down >= MONOTONE else "mixed"
        words[name] = word
        signs.append({"rising": 1, "falling": -1, "mixed": 0}[word])
    return words, shares, signs

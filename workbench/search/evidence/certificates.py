"""Which gap a search states: of an enumeration, of the user's certificates, or of the Kriging.

A certificate rests on the user's word. Where the runs contradict it, or the enclosure fails, the runs are not
lost: the gap of the Kriging is stated in its place, with the reason.
"""

from collections.abc import Callable
from dataclasses import replace
from math import inf

import numpy as np

from workbench.errors import StudyError
from workbench.search.evidence.enclosure import Enclosure, enclosure_gap
from workbench.search.evidence.gap import (
    BOUND_FACTOR,
    COVERAGE,
    Gap,
    lipschitz_gap,
)
from workbench.search.runs.ledger import Ledger, distinct
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.model import SearchModel

__all__ = ["enumerated_gap", "failed_points", "stated_gap"]


def stated_gap(
    ledger: Ledger,
    model: SearchModel | None,
    modelled: Callable[[], Gap],
    *,
    tolerance: float,
    lipschitz: float | None,
    enclosure: Enclosure | None,
) -> Gap:
    """The narrowest gap that holds; `modelled` gives the one of the Kriging, when it comes to that.

    `model` is None where an enumeration of a few points left too few values for one.
    """
    exhausted = enumerated_gap(ledger, model) if ledger.is_exhausted else None
    if exhausted is not None and not exhausted.failed:
        return _noted(exhausted, ledger, [])
    certificates: list[Gap] = []
    notes: list[str] = []
    where, u, v = ledger.where, ledger.u_ok, ledger.v
    try:
        if lipschitz is not None:
            names = [_name(run.key, i) for i, run in enumerate(ledger.runs) if ledger.ok[i]]
            certificates.append(lipschitz_gap(where, u=u, v=v, constant=lipschitz, names=names))
    except StudyError as exc:
        notes.append(f"the given Lipschitz constant does not hold: {exc}")
    try:
        if enclosure is not None:
            accuracy = max(tolerance, 0.0) * ledger.scale
            certificates.append(
                enclosure_gap(where, enclosure, u=u, v=v, sign=ledger.sign, tolerance=accuracy)
            )
    except StudyError as exc:
        notes.append(f"the given enclosure does not hold: {exc}")
    if certificates:
        gap = min(certificates, key=lambda certificate: certificate.width)
    else:
        gap = exhausted or modelled()
    return _noted(gap, ledger, notes)


def enumerated_gap(ledger: Ledger, model: SearchModel | None) -> Gap:
    """The gap of a finite space of which every point was run: none, unless runs failed.

    A failed point may be worse than all others. Its bound is the Kriging's, or unknown without one; points
    that a reading such as `within` excludes cannot be.
    """
    best = float(ledger.v.max())
    settled = np.array([run.value is not None or run.status == "excluded" for run in ledger.runs], dtype=bool)
    failed = failed_points(ledger.where, ledger.u, settled)
    if not len(failed):
        return Gap(upper=best, width=0.0, coverage=1.0, kind="enumerated")
    upper = inf
    if model is not None:
        judge = model.cautious or model
        upper = max(float(judge.bound(ledger.where.features(failed), BOUND_FACTOR).max()), best)
    return Gap(upper=upper, width=upper - best, coverage=COVERAGE, kind="enumerated", failed=len(failed))


def failed_points(where: SearchSpace, u: np.ndarray, settled: np.ndarray) -> np.ndarray:
    """Points (m, d) of runs at u (n, d) none of which is `settled` (n,): gave a value or was excluded."""
    failed = distinct(np.unique(u[~settled], axis=0), u[settled])
    allowed: np.ndarray = failed[where.allowed(failed)]
    return allowed


def _name(key: str, index: int) -> str:
    """How a message calls a run; keys of the store are bare."""
    if not key:
        return f"row {index + 1} of start"
    return key if "run " in key else f"run {key}"


def _noted(gap: Gap, ledger: Ledger, notes: list[str]) -> Gap:
    if ledger.is_flat:
        notes = [
            *notes,
            f"all {int(ledger.ok.sum())} runs gave the same value: the response does not depend on these "
            "parameters, the model ignores its inputs, or no run met the region where it changes",
        ]
    return replace(gap, note="; ".join(notes)) if notes else gap

"""Designs that are good by several criteria at once: the best of a few searches from different starts.

Few runs have arrangements of two sorts: some that spread best and leave the middle empty (30 runs of 8
factors: phi_p at its best, CD2 a quarter above its own), and some within 3 % of the best of both. A search
ends in the sort it began near, so several short ones are made, and the one of least excess is continued:

    excess = max over the spread criteria of (value / best value seen - 1) + CORRELATION * largest correlation

Where that still is much, the searches began too cold to leave the sort that they were in: one more begins
at a design of least CD2, which has its middle filled, under a higher bar.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from doe.latin.columns import Columns, Feasible
from doe.latin.swaps import LARGEST_RUNS, SwapResult, swap_search
from doe.portable.draws import Draws

__all__ = ["JOINT", "joint_search", "joint_swaps"]

JOINT = ("phi_p", "cd2", "correlation")
# a correlation of 0.05 weighs as much as one per cent of phi_p or CD2: below 0.1 it hardly hides anything,
# and the last hundredths would cost 2 to 4 % of CD2
WEIGHTS = (1.0, 1.0, 0.2)
CORRELATION = WEIGHTS[2]
STARTS = 6
SCOUTED = 0.4  # share of the swaps for the short searches of all starts
# swaps per entry of the design; at least, at most, and at most per run, whose cost grows with the runs
PER_ENTRY = 15_000
LEAST, MOST, PER_RUN = 200_000, 4_000_000, 200_000_000
FAR = 0.025  # excess above which one more search is made,
MORE = 0.25  # with so many of the swaps in addition,
MIDDLE = 0.3  # a part of them for the design of least CD2 that it begins at,
HEAT = 10.0  # and so many times the usual first bar: from 3 to 10 all do (decision 0169)


def joint_swaps(n: int, d: int) -> int:
    """Swaps of all starts together that are worth their time for n runs of d factors: below about a second.

    >>> joint_swaps(50, 15), joint_swaps(6, 2), joint_swaps(1000, 20)
    (4000000, 200000, 200000)
    """
    return int(min(np.clip(PER_ENTRY * n * d, LEAST, MOST), PER_RUN // n))


def joint_search(
    columns: Columns,
    starts: Sequence[NDArray[np.int32]],
    *,
    swaps: int,
    criteria: Sequence[str] = JOINT,
    feasible: Feasible | None = None,
    draws: Draws,
) -> SwapResult:
    """The design of least excess of searches from each of the `starts`, entries (d, n), `swaps` in all.

    criteria: two or more of JOINT    feasible: see `swap_search`
    Of several starts, where the best is still far from the best phi_p or CD2 seen, a quarter more is made.
    Of more runs than the tables of distances take, only the correlations are lowered.

    Raises: ValueError for no start.
    """
    if not starts:
        raise ValueError("joint_search needs at least one start, got none")
    if columns.levels.shape[1] > LARGEST_RUNS:
        return swap_search(
            columns, starts[0], criterion="correlation", swaps=swaps, feasible=feasible, draws=draws
        )
    weights = [WEIGHTS[JOINT.index(name)] for name in criteria]

    def searched(
        entries: NDArray[np.int32],
        trials: int,
        *,
        heat: float = 1.0,
        reference: Mapping[str, float] | None = None,
    ) -> SwapResult:
        return swap_search(
            columns,
            entries,
            criterion=criteria,
            weights=weights,
            swaps=trials,
            feasible=feasible,
            heat=heat,
            reference=reference,
            draws=draws,
        )

    scouting = int(SCOUTED * swaps / len(starts)) if len(starts) > 1 else 0
    found = [searched(entries, scouting) for entries in starts] if scouting else []
    beginning = np.ascontiguousarray(min(found, key=_excess(found)).entries.T) if found else starts[0]
    found.append(searched(beginning, swaps - scouting * len(found)))
    chosen = min(found, key=_excess(found))
    if len(starts) > 1 and {"phi_p", "cd2"} <= set(criteria) and _excess(found)(chosen) > FAR:
        more = int(MORE * swaps)
        centred = swap_search(
            columns, beginning, criterion="cd2", swaps=int(MIDDLE * more), feasible=feasible, draws=draws
        )
        middle = np.ascontiguousarray(centred.entries.T)
        best = _alone(found)
        best["cd2"] = min(best["cd2"], centred.values["cd2"])
        hot = searched(middle, more - centred.swaps, heat=HEAT, reference=best)
        found.append(replace(hot, swaps=more, accepted=hot.accepted + centred.accepted))
        chosen = min(found, key=_excess(found))
    return replace(
        chosen,
        swaps=sum(f.swaps for f in found),
        accepted=sum(f.accepted for f in found),
        alone=_alone(found),
    )


def _alone(found: Sequence[SwapResult]) -> dict[str, float]:
    """The least of each criterion that searches of it alone reached."""
    return {name: min(f.alone[name] for f in found) for name in found[0].alone}


def _excess(found: Sequence[SwapResult]) -> Callable[[SwapResult], float]:
    """The excess of a result over the best values seen in all of them."""
    spread = [name for name in found[0].values if name != "correlation"]
    best = {name: min(min(f.values[name], f.alone[name]) for f in found) for name in spread}

    def excess(result: SwapResult) -> float:
        worst = max(_share(result.values[name], best[name]) for name in spread)
        return worst + CORRELATION * result.values.get("correlation", 0.0)

    return excess


def _share(value: float, best: float) -> float:
    """How far a value lies above the best, as a share of it; 0 where two runs coincide in every design."""
    return value / best - 1.0 if np.isfinite(best) and best > 0.0 else 0.0

"""Bill of materials: what each member of a layout is, and what it has to bear over all scenarios.

Every scenario is simulated once more at the density asked for; peaks are those at the nodes of its run, and
the energy taken up is the integral of force times rate of elongation since the start.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...elements.timed import bare
from ...objectives.member_histories import MemberHistories, member_histories
from ..formulation.member_names import member_names
from ..formulation.problem import InvalidLayout, LayoutProblem

__all__ = ["Bill", "BillEntry", "BodyShape", "Extreme", "bill_of_materials"]

Array = NDArray[np.float64]

LEAST = 1e-3  # of the way from the lower to the upper bound: thinner members are counted, not listed


@dataclass(frozen=True, slots=True, kw_only=True)
class Extreme:
    """A largest value, when it is reached (s) and in which scenario (its number)."""

    value: float
    time: float
    scenario: int


@dataclass(frozen=True, slots=True, kw_only=True)
class BillEntry:
    """One member.

    number, name, kind: which it is    body_a, point_a, body_b, point_b: its ends, m, global at the start
    length: m at the start    density    shares (budgets,): of every limit
    tension, compression: largest pull and push, N, >= 0    stretch, shortening: m, >= 0, from the natural
    length    energy: most energy taken up since the start, J
    """

    number: int
    name: str
    kind: str
    body_a: str
    point_a: Array
    body_b: str
    point_b: Array
    length: float
    density: float
    shares: Array
    tension: Extreme
    compression: Extreme
    stretch: Extreme
    shortening: Extreme
    energy: Extreme

    @property
    def force(self) -> Extreme:
        """The larger of pull and push."""
        return max(self.tension, self.compression, key=lambda e: e.value)

    @property
    def elongation(self) -> Extreme:
        """The larger of stretch and shortening."""
        return max(self.stretch, self.shortening, key=lambda e: e.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyShape:
    """A body at the start, for drawings: its origin and all points where a member may be tied to it, m."""

    name: str
    points: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Bill:
    """The members that are there, thickest first.

    left_out: how many have less than a thousandth of their range    left_out_share (budgets,): what these use
    scenarios: names    budgets: names    bodies: for drawings
    """

    entries: tuple[BillEntry, ...]
    left_out: int
    left_out_share: Array
    scenarios: tuple[str, ...]
    budgets: tuple[str, ...]
    bodies: tuple[BodyShape, ...]


def bill_of_materials(problem: LayoutProblem, density: Array) -> Bill:
    """The bill of a layout of moving systems (planar, spatial trees, points).

    Raises InvalidLayout for a problem without runs, such as a truss, and what a simulation raises.
    """
    if problem.simulated is None:
        raise InvalidLayout(
            "a bill of materials needs the runs of moving systems; make the problem with transient_problem"
        )
    density = np.asarray(density, dtype=float)
    if density.shape != (problem.members,):
        raise InvalidLayout(f"density needs one number for each of the {problem.members} members")
    there = density > problem.lower + LEAST * (problem.upper - problem.lower)
    there |= ~problem.free & (density > 0.0)
    there = there[: problem.densities]
    chosen = np.flatnonzero(there)
    chosen = chosen[np.argsort(-density[chosen], kind="stable")]
    runs = problem.simulated(density)
    limits = np.where(problem.limits == 0.0, 1.0, problem.limits)
    shares = (problem.costs * density / limits[:, None])[:, : problem.densities]
    found = [member_histories(run, chosen.tolist()) for _, run in runs]
    times = [np.asarray(run.times) for _, run in runs]
    system = runs[0][1].system
    ends = system.member_ends()
    kinds = [type(bare(m.law)).__name__.lower() for m in system.members]
    if problem.geometry is not None:
        kinds = list(problem.geometry.kind)
    names = member_names(kinds, [str(getattr(m, "name", "")) for m in system.members])
    entries = []
    for at, i in enumerate(chosen.tolist()):
        member = system.members[i]
        entries.append(
            BillEntry(
                number=i, name=names[i], kind=kinds[i], body_a=member.a,
                point_a=ends.point_a[i], body_b=member.b, point_b=ends.point_b[i],
                length=float(found[0].length[0, at]), density=float(density[i]), shares=shares[:, i],
                **_extremes(found, times, at),
            )
        )  # fmt: skip
    return Bill(
        entries=tuple(entries), left_out=int((~there).sum()), left_out_share=shares[:, ~there].sum(axis=1),
        scenarios=tuple(name or f"scenario {k + 1}" for k, (name, _) in enumerate(runs)),
        budgets=problem.names, bodies=_bodies(system, ends),
    )  # fmt: skip


def _extremes(found: list[MemberHistories], times: list[Array], at: int) -> dict[str, Extreme]:
    """The largest of every series of a member over all scenarios."""
    series: dict[str, list[Array]] = {
        "tension": [h.force[:, at] for h in found],
        "compression": [-h.force[:, at] for h in found],
        "stretch": [h.elongation[:, at] for h in found],
        "shortening": [-h.elongation[:, at] for h in found],
        "energy": [h.work(t)[:, at] for h, t in zip(found, times, strict=True)],
    }
    out = {}
    for name, each in series.items():
        scenario = int(np.argmax([s.max() for s in each]))
        node = int(each[scenario].argmax())
        value = max(0.0, float(each[scenario][node]))
        out[name] = Extreme(value=value, time=float(times[scenario][node]), scenario=scenario)
    return out


def _bodies(system: Any, ends: Any) -> tuple[BodyShape, ...]:
    """Every body that a member is tied to, with the points of all members on it; the ground has no shape."""
    points: dict[str, list[Array]] = {}
    for i, member in enumerate(system.members):
        for name, point in ((member.a, ends.point_a[i]), (member.b, ends.point_b[i])):
            if name != "ground":
                points.setdefault(name, []).append(np.asarray(point, float))
    return tuple(
        BodyShape(name=name, points=np.unique(np.array(some), axis=0)) for name, some in points.items()
    )

"""What members do along a run of any kind of system: elongation, its rate, force and energy, eq. (2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.law_series import law_series
from ..integration.kinds import AnyTrajectory
from .line import End, line_series

__all__ = ["MemberHistories", "member_histories", "member_line"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class MemberHistories:
    """Series of M members at all nodes, (steps + 1, M) each.

    elongation: m, length less natural length    rate: m/s    length: m
    force: N, tension positive, with the density of the run    energy: J stored (zero for a user's law)
    by_elongation, by_rate: slopes of the force    unit_force: N, the force at density 1
    """

    members: tuple[int, ...]
    length: Array
    elongation: Array
    rate: Array
    force: Array
    energy: Array
    by_elongation: Array
    by_rate: Array
    unit_force: Array

    def work(self, times: Array) -> Array:
        """(steps + 1, M) J that the members have taken up since the start: the integral of force times rate.

        Trapezoids over the nodes: second order in the step.
        """
        power = self.force * self.rate
        step = 0.5 * np.diff(times)[:, None] * (power[1:] + power[:-1])
        return np.vstack([np.zeros((1, step.shape[1])), np.cumsum(step, axis=0)])


def member_line(member: Any) -> tuple[End, End, float]:
    """The ends (body, point on it) of a member and its offset out of the plane."""
    a, b = (tuple(getattr(member, f"point_{end}", (0.0, 0.0, 0.0))) for end in "ab")
    return (member.a, a), (member.b, b), float(getattr(member, "offset", 0.0))


def member_histories(trajectory: AnyTrajectory, members: Sequence[int] | None = None) -> MemberHistories:
    """Histories of some members, by number, or of all.

    Raises ValueError for a number that the system does not have.

    >>> from workbench.engine import Body, Member, Spring, System, simulate
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))
    >>> run = simulate(System(bodies=(mass,), members=(spring,)), [1.0], t_end=1.0, steps=200)
    >>> float(member_histories(run).force.max().round(2))  # v0 sqrt(k m)
    1.58
    """
    system = trajectory.system
    count = len(system.members)
    chosen = tuple(range(count)) if members is None else tuple(int(i) for i in members)
    for i in chosen:
        if not 0 <= i < count:
            raise ValueError(f"member needs to be one of 0 to {count - 1}, got {i}")
    shape = len(trajectory.times), len(chosen)
    length, rate = np.empty(shape), np.empty(shape)
    natural = np.empty(len(chosen))
    for at, i in enumerate(chosen):
        member = system.members[i]
        length[:, at], rate[:, at] = line_series(trajectory, *member_line(member))
        natural[at] = length[0, at] if member.natural_length is None else member.natural_length
    elongation = length - natural
    f, fd, fv, energy = (np.empty(shape) for _ in range(4))
    alike: dict[int, list[int]] = {}
    for at, i in enumerate(chosen):
        alike.setdefault(system.members[i].law.code, []).append(at)
    for same in alike.values():
        laws = [system.members[chosen[at]].law for at in same]
        found = law_series(laws, elongation[:, same], rate[:, same], np.asarray(trajectory.times))
        for out, part in zip((f, fd, fv, energy), found, strict=True):
            out[:, same] = part
    some = list(chosen)
    power = np.array([system.members[i].power for i in chosen])
    scale = np.asarray(trajectory.density)[some] ** power
    return MemberHistories(
        members=chosen, length=length, elongation=elongation, rate=rate, force=scale * f,
        energy=scale * energy, by_elongation=scale * fd, by_rate=scale * fv, unit_force=f,
    )  # fmt: skip

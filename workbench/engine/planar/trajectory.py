"""The solution of a system on its time grid, with what is needed to judge it."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..integration.independent import Splits
from ..integration.outcome import Diagnosis, Status
from ..integration.schemes import Scheme
from ._kernels.energy import member_energy_series, torsion_energy_sum
from ._kernels.equations import evaluate, place
from ._kernels.tables import Tables, Work, work_space
from .system import System

__all__ = ["Tangents", "Trajectory"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tangents:
    """Tangents at the converged states of a run, kept for its adjoint.

    stiffness, damping: (steps + 1, n, n) dF/dq with the geometric term, dF/dv.  jacobian: (steps + 1, m, n)
    Phi_q.  energy: (steps + 1,) stored in the members, where all are undamped springs. Node 0
    is filled by `Trajectory.complete_tangents`. Arrays of length 0 when nothing was kept.
    """

    stiffness: Array
    damping: Array
    jacobian: Array
    energy: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory:
    """States at the nodes of the time grid; coordinates are (x, y, theta) of every free body in order.

    times: (steps + 1,).  position, velocity, acceleration: (steps + 1, n).  multiplier: (steps + 1, m), one
    per
    joint row.  damage: (steps + 1, bushings) with rate damage_rate.
    """

    system: System
    density: Array
    scheme: Scheme
    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    damage: Array
    damage_rate: Array
    diagnosis: Diagnosis
    tables: Tables
    tangents: Tangents | None = None
    splits: Splits | None = None  # of a run in independent coordinates
    status: Status = Status.COMPLETE
    memo: dict[str, Any] = field(default_factory=dict, repr=False)  # derived series, computed once

    def __post_init__(self) -> None:
        for name in ("density", "times", "position", "velocity", "acceleration", "multiplier", "damage"):
            getattr(self, name).flags.writeable = True

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return float(self.times[1] - self.times[0])

    @property
    def work(self) -> Work:
        """Work arrays of the kernels on this run's tables, made once."""
        if "work" not in self.memo:
            self.memo["work"] = work_space(self.tables)
        return self.memo["work"]  # type: ignore[no-any-return]

    def of(self, body: str) -> Array:
        """(steps + 1, 3) position of a body, free or prescribed."""
        for index, part in enumerate(self.system.prescribed):
            if part.name == body:
                return self.tables.motion[:, 0, 3 * index : 3 * index + 3]
        return self.position[:, self.system.coordinate(body)]

    def kinetic_energy(self) -> Array:
        """(steps + 1,) kinetic energy of the free bodies, J."""
        return np.asarray(0.5 * (self.velocity**2 @ self.tables.mass))

    def complete_tangents(self) -> None:
        """Fill in the kept tangents of the start, once; the forward run leaves them out."""
        kept = self.tangents
        if kept is None or len(kept.stiffness) == 0 or "start" in self.memo:
            return
        z, work = self.damage[0], self.work
        evaluate(
            self.tables, work, 0, self.position[0], self.velocity[0], self.multiplier[0], z, z, 0.0, True
        )
        kept.stiffness[0], kept.damping[0], kept.jacobian[0] = work.k, work.c, work.phi_q
        kept.energy[:1] = work.energy
        self.memo["start"] = True

    def stored_energy(self) -> Array:
        """(steps + 1,) energy stored in the members, J."""
        if "stored_energy" not in self.memo:
            kept = self.tangents.energy if self.tangents is not None else np.empty(0)
            if len(kept):  # the run knows them from its tangents
                self.complete_tangents()
                energy = kept.copy()
            else:
                energy, nodes = np.empty(len(self.times)), np.arange(len(self.times))
                member_energy_series(self.tables, self.work, nodes, self.position, self.velocity, energy)
            self.memo["stored_energy"] = energy
        return np.array(self.memo["stored_energy"])

    def spring_energy(self) -> Array:
        """(steps + 1,) energy stored in the joint springs, J."""
        work = self.work
        energy = np.zeros(len(self.times))
        for step in range(len(self.times)):
            place(self.tables, work, step, self.position[step], self.velocity[step])
            energy[step] = torsion_energy_sum(self.tables, work)
        return energy

    def gravity_energy(self) -> Array:
        """(steps + 1,) potential of gravity, J, zero at the global origin."""
        return np.asarray(-self.position @ self.tables.gravity)

    def mechanical_energy(self) -> Array:
        """(steps + 1,) kinetic, stored and gravity energy, J; constant where nothing dissipates or drives."""
        return self.kinetic_energy() + self.stored_energy() + self.spring_energy() + self.gravity_energy()

    def joint_residuals(self) -> Array:
        """(steps + 1, m) Phi at every node: how well the joints hold, m or rad."""
        work = self.work
        out = np.zeros((len(self.times), len(self.tables.row)))
        for step in range(len(self.times)):
            z = self.damage[step]
            evaluate(
                self.tables, work, step, self.position[step], self.velocity[step],
                self.multiplier[step], z, z, 0.0, False,
            )  # fmt: skip
            out[step] = work.phi
        return out

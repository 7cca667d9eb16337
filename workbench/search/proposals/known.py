"""What is known when the next point of a search is chosen."""

from dataclasses import dataclass, replace

import numpy as np

from workbench.search.runs.ledger import Ledger
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.fitting import believing
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.success import SuccessChance

__all__ = ["LEAST_CHANCE", "Known"]

# an even chance would tell most about where the border of failures runs; a likelier run costs less, and so
# many of those that a search proposes succeed
LEAST_CHANCE = 0.7


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """The runs at u (n, d), failed ones included; those at u_ok (m, d) gave the signed values v (m,), and
    `incumbent` (d,) is the worst of them. `under_way` (k, d): the points of the batch so far, which u holds,
    too.
    """

    where: SearchSpace
    model: SearchModel
    success: SuccessChance
    u: np.ndarray
    u_ok: np.ndarray
    v: np.ndarray
    incumbent: np.ndarray
    under_way: np.ndarray

    @classmethod
    def of(cls, ledger: Ledger, model: SearchModel, success: SuccessChance) -> "Known":
        """What the runs of a search say before a batch."""
        return cls(
            where=ledger.where,
            model=model,
            success=success,
            u=ledger.u,
            u_ok=ledger.u_ok,
            v=ledger.v,
            incumbent=ledger.incumbent,
            under_way=np.empty((0, ledger.where.dimension)),
        )

    def believing(self, point: np.ndarray) -> "Known":
        """The same with a run at `point` (d,) that gives what the model predicts there."""
        u_ok = np.vstack([self.u_ok, point])
        features = self.where.features(u_ok)
        v = np.append(self.v, self.model.mean(features[-1:]))
        return replace(
            self,
            model=believing(self.model, features, v),
            u=np.vstack([self.u, point]),
            u_ok=u_ok,
            v=v,
            under_way=np.vstack([self.under_way, point]),
        )

"""What is known when the next point of a search is chosen."""

from dataclasses import dataclass, replace

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.search.runs.ledger import Ledger
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.fitting import believing
from workbench.search.surrogate.model import SearchModel

__all__ = ["LEAST_CHANCE", "Known", "failed_share"]

# an even chance would tell most about where the border of failures runs; a likelier run costs less, and so
# many of those that a search proposes succeed
LEAST_CHANCE = 0.7
# a search asks for the point of the highest score, where a chance is overrated: while more than RATE of its
# runs have failed the least chance rises, by SLOPE for each share of failed runs beyond, up to MOST
RATE, SLOPE, MOST = 0.3, 2.0, 0.97
SETTLING = 8  # runs of a search before its share of failures is taken as such


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """The runs at u (n, d), failed ones included; those at u_ok (m, d) gave the signed values v (m,), and
    `incumbent` (d,) is the worst of them. `under_way` (k, d): the points of the batch so far, which u holds,
    too. Where runs are less likely to succeed than `least_chance` none is proposed.
    """

    where: SearchSpace
    model: SearchModel
    success: SuccessChance
    u: np.ndarray
    u_ok: np.ndarray
    v: np.ndarray
    incumbent: np.ndarray
    under_way: np.ndarray
    least_chance: float = LEAST_CHANCE

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
            least_chance=_least_chance(ledger),
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


def failed_share(ledger: Ledger) -> float:
    """The share of the search's own runs, without its start design, that failed; of eight at least."""
    searched = [run for run in ledger.runs if run.number > 0 and run.proposal != "start"]
    return sum(run.value is None for run in searched) / max(len(searched), SETTLING)


def _least_chance(ledger: Ledger) -> float:
    """The least chance of success that a run is proposed with, after the failures of the search so far."""
    return min(LEAST_CHANCE + SLOPE * max(failed_share(ledger) - RATE, 0.0), MOST)

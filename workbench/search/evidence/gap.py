"""How much worse could it still be: an upper bound of the response over the space, with its kind stated.

    model-based    max over u of m(u) + 3 kappa s(u), kappa from leave-one-out, the larger of two models: the
                   cautious twin of the search's model, and the roughest model of the plain values that the
                   runs do not refute; regions where runs almost surely fail are left out
    Lipschitz      max over u of min_i (v_i + L |u - u_i|), a certificate when L is right
    enclosure      branch and bound on the user's interval enclosure, a certificate
                   (`workbench.search.evidence.enclosure`)
    enumerated     every point of a finite space was run: nothing is left but points that failed

A model-based gap is a statement about the Kriging and is calibrated, not proven:
`studies/worst_case_calibration.py` counts how often it covers the true gap of functions with known extremes.
A bound through a logarithm can lie absurdly far out; the cautious twin states no more than the range of the
values seen.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.errors import StudyError
from workbench.search.runs.ledger import Ledger
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.fitting import fit_rough_model
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream
from workbench.space.units import number

__all__ = ["COVERAGE", "HOPELESS", "Gap", "lipschitz_gap", "modelled_gap"]

COVERAGE = 0.95
BOUND_FACTOR = 3.0  # a supremum over the box needs a wider factor than one point does
HOPELESS = 0.1  # chance of success below which a region is left out of the gap
RANDOM_POINTS = 4000
REFINED = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """`width` >= 0: how far beyond the confirmed worst the response could lie, in its `unit`. `upper` is the
    bound itself (a lower bound of the response when small is bad); both are infinite where nothing is known.

    Of an enclosure: its `calls`, and whether they brought the width below the tolerance. Of an enumeration:
    how many points `failed`. `note`: what a reader must know beside it, such as a certificate that the runs
    refute. `subject`: what could be worse, "the mean" where runs have noise.

    >>> Gap(upper=5.2, width=0.2, coverage=0.95, kind="model-based", unit="mm").sentence
    'By the Kriging with 95 % confidence it could be at most 0.2 mm worse (model-based, not a proof).'
    """

    upper: float
    width: float
    coverage: float
    kind: str
    calls: int = 0
    closed: bool = True
    failed: int = 0
    note: str = ""
    unit: str = "1"
    subject: str = "it"

    def to_dict(self) -> dict[str, Any]:
        """For the JSON document."""
        plain = asdict(self)
        del plain["unit"], plain["subject"]  # the document's own, and said in the sentence
        if self.kind != "enclosure":
            del plain["calls"], plain["closed"]
        for name in ("failed", "note"):
            if not plain[name]:
                del plain[name]
        for name in ("upper", "width"):
            plain[name] = plain[name] if isfinite(plain[name]) else None
        return {**plain, "lower": 0.0, "sentence": self.sentence}

    @property
    def sentence(self) -> str:
        """What to tell a reader: the one wording that results, documents, terminal and report show."""
        note = self.note.rstrip(".")
        if self.kind == "model-based" and not isfinite(self.width):
            return self._claim
        return f"{self._claim} {note[:1].upper()}{note[1:]}." if note else self._claim

    @property
    def _claim(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        width = f"{number(self.width, 4)}{unit}" if isfinite(self.width) else "an unknown amount"
        if self.kind == "enumerated":
            if not self.failed:
                return "Every point of the space was run: nothing worse exists."
            return f"Every point of the space was run; {self.failed} failed and may be worse, by {width}."
        if self.kind == "Lipschitz":
            return f"With the given Lipschitz constant it is certain that at most {width} more is possible."
        if self.kind == "enclosure":
            end = "" if self.closed else "; more calls of it would narrow this"
            return (
                f"By the given interval enclosure it is certain that at most {width} more is possible{end}."
            )
        if not isfinite(self.width):
            return f"No bound is known on how much worse it could be: {self.note}."
        hidden = "" if self.subject == "it" else "; of what noise hides from all runs it says nothing"
        return (
            f"By the Kriging with {100 * self.coverage:.0f} % confidence {self.subject} could be at most "
            f"{width} worse ({self.kind}, not a proof{hidden})."
        )


def modelled_gap(ledger: Ledger, model: SearchModel, success: SuccessChance, *, seed: int, full: bool) -> Gap:
    """The model-based gap above the best run of `ledger`.

    The bound is searched at random points and at the runs' own, and when `full` by pattern search from the
    highest of them. Without `full` it is the gap of the cautious twin alone: a quick look, which a search may
    take before every batch.
    """
    where, v = ledger.where, ledger.v
    best = float(v.max())
    cautious = model.cautious or model
    ceiling = best + float(np.ptp(v))
    rng = stream(seed, "gap", replicate=ledger.spent)
    rough = fit_rough_model(where.features(ledger.u_ok), v, model, seed=seed) if full else None

    def score(points: np.ndarray) -> np.ndarray:
        features = where.features(points)
        bound = np.minimum(cautious.bound(features, BOUND_FACTOR), ceiling)
        if rough is not None:
            bound = np.maximum(bound, rough.bound(features, BOUND_FACTOR))
        possible = where.allowed(points) & (success.probability(features) > HOPELESS)
        return np.where(possible, bound, -np.inf)

    inside = rng.random((RANDOM_POINTS, where.dimension))
    corners = rng.integers(0, 2, (RANDOM_POINTS // 2, where.dimension)).astype(float)
    points = where.snap(np.vstack([inside, corners, ledger.u]))
    bounds = score(points)
    upper = float(bounds.max())
    if full:
        top = points[np.argsort(bounds)[-REFINED:]]
        upper = max(upper, float(maximise_score(score, top, where.levels, sweeps=25)[1].max()))
    return Gap(upper=max(upper, best), width=max(upper - best, 0.0), coverage=COVERAGE, kind="model-based")


def lipschitz_gap(
    where: SearchSpace,
    *,
    u: np.ndarray,
    v: np.ndarray,
    constant: float,
    names: Sequence[str] | None = None,
    boxes: int = 20_000,
) -> Gap:
    """A certificate: branch and bound on max_u min_i (v_i + L |u - u_i|) for runs u (n, d), v (n,).

    A box with centre c and half diagonal h cannot hold more than min_i (v_i + L |c - u_i|) + L h. The
    largest such bound is an upper bound of the response at any time, so stopping after `boxes` boxes leaves
    it valid. Levelled coordinates are treated as continuous, which only loosens it.

    `names` (n,) of the runs, for the message.

    Raises:
        StudyError: the constant is not positive, or the runs contradict it.
    """
    if not constant > 0:
        raise StudyError(f"lipschitz needs a constant > 0 per unit of the cube, got {constant}")
    distance = np.linalg.norm(u[:, None] - u[None], axis=2)
    excess = np.abs(v[:, None] - v[None]) - constant * distance
    if excess.max() > 1e-9 * max(1.0, float(np.abs(v).max())):
        i, j = sorted(int(k) for k in np.unravel_index(int(excess.argmax()), excess.shape))
        first, second = (f"run {k + 1}" if names is None else names[k] for k in (i, j))
        raise StudyError(
            f"lipschitz={constant:g} is contradicted by {first} and {second}, which differ by "
            f"{abs(v[i] - v[j]):.6g} over a distance of {distance[i, j]:.6g} in the unit cube. "
            "Give a larger constant"
        )

    def cone(points: np.ndarray) -> np.ndarray:
        gaps = np.linalg.norm(points[:, None] - u[None], axis=2)
        lowest: np.ndarray = (v + constant * gaps).min(axis=1)
        return lowest

    best = float(v.max())
    d = where.dimension
    centres, halves = np.full((1, d), 0.5), np.full((1, d), 0.5)
    bounds = cone(centres) + constant * np.linalg.norm(halves, axis=1)
    done = 0
    while done < boxes and bounds.max() > best:
        split = np.argsort(bounds)[-256:]
        done += len(split)
        keep = np.setdiff1d(np.arange(len(bounds)), split)
        axis = halves[split].argmax(axis=1)
        half = halves[split].copy()
        half[np.arange(len(split)), axis] /= 2
        shift = np.zeros_like(half)
        shift[np.arange(len(split)), axis] = half[np.arange(len(split)), axis]
        new_centres = np.vstack([centres[split] - shift, centres[split] + shift])
        new_halves = np.vstack([half, half])
        parents = np.concatenate([bounds[split], bounds[split]])
        new_bounds = np.minimum(parents, cone(new_centres) + constant * np.linalg.norm(new_halves, axis=1))
        centres = np.vstack([centres[keep], new_centres])
        halves = np.vstack([halves[keep], new_halves])
        bounds = np.concatenate([bounds[keep], new_bounds])
        if halves.max() < 1e-4:
            break
    upper = max(float(bounds.max()), best)
    return Gap(upper=upper, width=upper - best, coverage=1.0, kind="Lipschitz")

"""Values of layouts that were not simulated, predicted from those that were, their slopes included.

Between rigid bodies the response sees the densities through a few sums (`outcome/purify.py`), whatever the
number of members. The slopes known so far span these directions: their leading singular vectors V turn shares
x into features V'x. Two processes learn in them (`sloped_process`):

histories   whole histories of all cases, as asinh(value / best) in their principal components: smooth where
            the largest value over time and cases has kinks. From the better half of the designs.
peaks       the largest value of each case, from all designs: where histories go elsewhere altogether.

The expected improvement (Jones, Schonlau and Welch 1998) is that of the largest of all cases.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from .runs import Runs
from .sloped_process import SlopedProcess

__all__ = ["KINDS", "Prediction", "Setting", "predicted"]

Array = NDArray[np.float64]

KINDS = ("histories", "peaks")

_DIRECTIONS = 10
_STRENGTH = 1e-3  # of the largest singular value, below which a direction or a component is not kept
_COMPONENTS = 25
_SLOPES = 400  # numbers that a process uses, at most
_FEWEST, _MOST = 40, 90  # designs from which histories are learnt
_POWERS = (0.5, 1.0)  # of the singular values in the lengths of features
_LENGTHS = (0.5, 1.0)  # of the process over the median distance
_NOISE = (1e-5, 1e-3)  # variance that the directions do not explain
_STEPS = 24  # of the integral that is the expected improvement


class Setting(NamedTuple):
    """What a fit chose: directions (members, k) over their lengths, and the noise."""

    directions: Array
    noise: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Of the largest value of each case.

    setting: with which a fit of a few more designs is quicker    unit: what values are measured by
    """

    setting: Setting
    unit: float
    _process: SlopedProcess
    _middle: Array
    _basis: Array
    _cases: int

    def features(self, designs: Array, table: Array) -> Array:
        """(p, k) of designs (p, states) whose shares are `designs @ table`, (states, members)."""
        return np.asarray(designs @ (table @ self.setting.directions))

    def values(self, at: Array) -> Array:
        """(p,): what is expected of designs with features (p, k), on the scale asinh(value / unit)."""
        return self._histories(at).max(axis=(1, 2))

    def spread(self, at: Array) -> tuple[Array, Array]:
        """(p, cases): expected largest values on that scale, and their standard deviations."""
        expected = self._histories(at)
        places = expected.argmax(axis=2)
        spread = np.sqrt((self._basis**2 * self._process.scales[:, None]).sum(axis=0))
        each = spread.reshape(self._cases, -1)[np.arange(self._cases)[None], places]
        variance = self._process.variance(at)
        return expected.max(axis=2), np.maximum(each * np.sqrt(variance)[:, None], 1e-12)

    def improvement(self, at: Array, best: float, *, doubt: float = 1.0) -> Array:
        """(p,): expected improvement of the best value known, relative to it.

        doubt: factor of the standard deviations.
        """
        means, deviations = self.spread(at)
        each = doubt * deviations
        known = np.arcsinh(best / self.unit)
        below = np.linspace(0.0, 4.0, _STEPS) * each.max(axis=1)[:, None]
        chance = ndtr(((known - below)[:, :, None] - means[:, None, :]) / each[:, None, :]).prod(axis=2)
        slope = np.hypot(best, self.unit)  # d value / d asinh(value / unit)
        return np.asarray(np.trapezoid(chance, below, axis=1) * slope / max(abs(best), 1e-300))

    def error(self, at: Array, value: float) -> float:
        """By how many standard deviations the value of a design with features (1, k) was foretold wrongly."""
        means, deviations = self.spread(at)
        case = int(means[0].argmax())
        return float((np.arcsinh(value / self.unit) - means[0, case]) / deviations[0, case])

    def _histories(self, at: Array) -> Array:
        found = self._process.mean(at) @ self._basis + self._middle
        return np.asarray(found.reshape(len(at), self._cases, -1))


def predicted(runs: Runs, kind: str, setting: Setting | None = None) -> Prediction:
    """A prediction from all runs so far; setting: one that was chosen from fewer runs of the same kind."""
    largest = np.array([h.max() for h in runs.histories])
    best = float(largest.min())
    unit = abs(best) if abs(best) > 1e-9 * np.abs(largest).max() else max(np.abs(largest).max(), 1e-300)
    order = np.argsort(largest, kind="stable")
    if kind == "histories":
        order = order[: min(max(_FEWEST, len(order) // 2), _MOST)]
    values, slopes = _data(runs, kind, order)
    known = values / unit
    scaled, by_value = np.arcsinh(known), 1.0 / np.sqrt(1.0 + known**2) / unit
    middle = scaled.mean(axis=0)
    strength, basis = np.linalg.svd(scaled - middle, full_matrices=False)[1:]
    count = int((strength > _STRENGTH * strength[0]).sum())
    basis, strength = basis[: max(1, min(_COMPONENTS, count))], strength[: max(1, min(_COMPONENTS, count))]
    parts = (scaled - middle) @ basis.T
    few = min(_DIRECTIONS, runs.problem.members) if setting is None else setting.directions.shape[1]
    sloped = np.arange(min(len(slopes), max(1, _SLOPES // few)))
    along = [(basis * by_value[i]) @ slopes[i] for i in sloped]  # (r, members) of each
    shares = np.array([runs.shares[i] for i in order])

    def process(chosen: Setting) -> SlopedProcess:
        back = np.linalg.pinv(chosen.directions)  # (k, members)
        by_feature = np.array([back @ slope.T for slope in along])
        return SlopedProcess(
            shares @ chosen.directions, sloped, parts,
            by_feature.reshape(len(sloped), len(back), len(basis)), noise=chosen.noise,
        )  # fmt: skip

    if setting is None:
        seen = np.vstack(along) if along else np.vstack([runs.peak_slopes[i] / unit for i in order])
        weights = strength**2 / max(float((strength**2).sum()), 1e-300)
        fits = [(one, process(one)) for one in _settings(seen, shares)]
        setting, fit = max(fits, key=lambda pair: float(pair[1].likelihood @ weights))
    else:
        fit = process(setting)
    return Prediction(
        setting=setting, unit=unit, _process=fit, _middle=middle, _basis=basis,
        _cases=len(runs.histories[0]),
    )  # fmt: skip


def _data(runs: Runs, kind: str, order: NDArray[np.intp]) -> tuple[Array, list[Array]]:
    """Values (designs, outputs), and the slopes (outputs, members) of every design or none."""
    if kind == "histories":
        slopes = [] if runs.slopes is None else [runs.slopes[i] for i in order]
        return np.array([runs.histories[i].ravel() for i in order]), slopes
    return (
        np.array([runs.histories[i].max(axis=1) for i in order]), [runs.peak_slopes[i] for i in order]
    )  # fmt: skip


def _settings(slopes: Array, shares: Array) -> list[Setting]:
    strength, modes = np.linalg.svd(slopes, full_matrices=False)[1:]
    kept = strength > _STRENGTH * max(float(strength[0]), 1e-300)
    kept[_DIRECTIONS:] = False
    if not kept.any():
        kept[0] = True
    share = strength[kept] / max(float(strength[0]), 1e-300)
    found = []
    for power in _POWERS:
        directions = modes[kept].T * np.where(share > 0, share, 1.0) ** power
        features = shares @ directions
        unit = max(float(np.median(cdist(features, features))), 1e-12)
        found += [Setting(directions / (unit * length), noise) for length in _LENGTHS for noise in _NOISE]
    return found

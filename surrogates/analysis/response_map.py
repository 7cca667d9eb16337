"""Monotone maps of a response to the scale that it is modelled on, and back: one place for all of them.

    none          w = y
    log           w = log y                                                         y > 0
    box-cox       w = (t^l - 1)/l,  log t for l = 0,  t = y/g                       y > 0
    yeo-johnson   w = ((1 + t)^l - 1)/l for t >= 0,  -((1 - t)^(2 - l) - 1)/(2 - l) for t < 0,
                  t = (y - median)/interquartile range
    ranks         w = rank of y, equal values share theirs

g is the geometric mean; l has the largest normal likelihood of the values w with their Jacobian. Box and Cox
(1964), Journal of the Royal Statistical Society B 26, 211-252; Yeo and Johnson (2000), Biometrika 87,
954-959. Beyond the runs the way back is held: a map may have an end that no prediction knows of.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import rankdata

__all__ = ["RESPONSE_SCALES", "ResponseMap", "admitted_scales", "response_map"]

Array = NDArray[np.float64]

RESPONSE_SCALES = ("none", "log", "ranks", "box-cox", "yeo-johnson")
BOUNDS = {"box-cox": (-2.0, 2.0), "yeo-johnson": (-1.0, 3.0)}
BEYOND = 3.0  # logarithms (or ranges of the runs) beyond the runs, where the way back stops
ZERO = 1e-8  # |l| below which a power is the logarithm


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseMap:
    """A map of one kind, anchored at the runs that it was made for.

    Attributes:
        scale: one of RESPONSE_SCALES.   power: l; nan where the scale has none.
        centre, unit: t = (y - centre)/unit.
        observed: (n,) responses of the runs, sorted.
    """

    scale: str
    power: float
    centre: float
    unit: float
    observed: Array

    @property
    def words(self) -> str:
        """The scale with its power."""
        return self.scale if np.isnan(self.power) else f"{self.scale} (power {self.power:.2f})"

    def forward(self, y: ArrayLike) -> Array:
        """The w of responses y, any shape; ranks between those of the runs."""
        values = np.asarray(y, dtype=np.float64)
        if self.scale == "none":
            return values
        if self.scale == "ranks":
            levels, first = np.unique(self.observed, return_index=True)
            ranks = rankdata(self.observed)[first]
            return np.asarray(np.interp(values, levels, ranks))
        t = (values - self.centre) / self.unit
        return _yeo_johnson(t, self.power) if self.scale == "yeo-johnson" else _box_cox(t, self._power)

    def inverse(self, w: ArrayLike) -> Array:
        """The responses of w, any shape, no farther beyond the runs than BEYOND says."""
        values = np.asarray(w, dtype=np.float64)
        if self.scale == "none":
            return values
        if self.scale == "ranks":
            levels, first = np.unique(self.observed, return_index=True)
            return np.asarray(np.interp(values, rankdata(self.observed)[first], levels))
        values = np.clip(values, *self.forward(np.array(self.ends)))
        if self.scale == "yeo-johnson":
            t = _yeo_johnson_back(values, self.power)
        else:
            t = _box_cox_back(values, self._power)
        return np.asarray(self.centre + self.unit * t)

    def q2(self, observed: ArrayLike, predicted: ArrayLike) -> float:
        """1 - squared error / squared deviations from the mean, of responses whose w are given."""
        y = self.inverse(observed)
        spread = float(((y - y.mean()) ** 2).sum())
        return 1.0 - float(((y - self.inverse(predicted)) ** 2).sum()) / spread if spread > 0.0 else np.nan

    @property
    def _power(self) -> float:
        return 0.0 if self.scale == "log" else self.power

    @property
    def ends(self) -> tuple[float, float]:
        """The responses between which the way back runs."""
        low, high = float(self.observed[0]), float(self.observed[-1])
        if self.scale == "yeo-johnson":
            return low - BEYOND * (high - low), high + BEYOND * (high - low)
        return low * np.exp(-BEYOND), high * np.exp(BEYOND)


def admitted_scales(y: ArrayLike) -> tuple[str, ...]:
    """The scales that the responses y (n,) can be mapped to.

    >>> admitted_scales([1.0, 2.0]), admitted_scales([-1.0, 2.0])
    (('none', 'log', 'ranks', 'box-cox', 'yeo-johnson'), ('none', 'ranks', 'yeo-johnson'))
    """
    positive = bool((np.asarray(y) > 0.0).all())
    return tuple(scale for scale in RESPONSE_SCALES if positive or scale not in ("log", "box-cox"))


def response_map(y: ArrayLike, scale: str) -> ResponseMap:
    """The map of responses y (n,) to `scale`, with the power that they suggest.

    >>> found = response_map(np.linspace(1.0, 3.0, 50) ** 2, "box-cox")
    >>> print(round(found.power, 2), found.inverse(found.forward([4.0])).round(6))
    0.37 [4.]

    Raises ValueError: another scale, or "log" and "box-cox" of a response that is not positive.
    """
    values = np.asarray(y, dtype=np.float64)
    if scale not in RESPONSE_SCALES:
        raise ValueError(f"scale needs one of {', '.join(RESPONSE_SCALES)}, got {scale!r}")
    if scale not in admitted_scales(values):
        what = "the logarithm" if scale == "log" else "box-cox"
        raise ValueError(
            f"{what} needs responses above 0, got {values.min():g}: take 'ranks' or 'yeo-johnson', or shift y"
        )
    centre, unit, power = 0.0, 1.0, float("nan")
    if scale == "box-cox":
        unit = float(np.exp(np.log(values).mean()))
        power = _likeliest(values / unit, scale)
    elif scale == "yeo-johnson":
        centre = float(np.median(values))
        low, high = np.quantile(values, [0.25, 0.75])
        unit = float(high - low) or float(np.ptp(values)) or 1.0
        power = _likeliest((values - centre) / unit, scale)
    return ResponseMap(scale=scale, power=power, centre=centre, unit=unit, observed=np.sort(values))


def _likeliest(t: Array, scale: str) -> float:
    """The power of largest profiled normal likelihood, -n/2 log var(w) + sum log dw/dt."""
    if np.ptp(t) <= 1e-12 * float(np.abs(t).max()):
        return 1.0

    def loss(power: float) -> float:
        if scale == "box-cox":
            w, slope = _box_cox(t, power), (power - 1.0) * float(np.log(t).sum())
        else:
            w = _yeo_johnson(t, power)
            slope = (power - 1.0) * float((np.sign(t) * np.log1p(np.abs(t))).sum())
        return 0.5 * len(t) * float(np.log(w.var())) - slope

    return float(minimize_scalar(loss, bounds=BOUNDS[scale], method="bounded").x)


def _box_cox(t: Array, power: float) -> Array:
    return np.asarray(np.log(t) if abs(power) < ZERO else np.expm1(power * np.log(t)) / power)


def _box_cox_back(w: Array, power: float) -> Array:
    return np.asarray(np.exp(w) if abs(power) < ZERO else np.exp(np.log1p(power * w) / power))


def _yeo_johnson(t: Array, power: float) -> Array:
    # the two halves are Box-Cox maps of 1 + |t|
    up, down = np.maximum(t, 0.0), np.maximum(-t, 0.0)
    return np.where(t >= 0.0, _box_cox(1.0 + up, power), -_box_cox(1.0 + down, 2.0 - power))


def _yeo_johnson_back(w: Array, power: float) -> Array:
    up, down = np.maximum(w, 0.0), np.maximum(-w, 0.0)
    return np.where(w >= 0.0, _box_cox_back(up, power) - 1.0, 1.0 - _box_cox_back(down, 2.0 - power))

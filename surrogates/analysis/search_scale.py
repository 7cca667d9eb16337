"""The scales of a search: maps of a response that bend it at the end that is looked at, and those by name.

For values y that are to be maximised, with spread s = upper quartile - lower quartile of y:

    identity     w = y
    toward max   w = -s log((y_max - y)/s + c)     stretches the region next to the best value
    away         w =  s log((y - y_min)/s + c)     compresses a few very large values
    plain        w = -s log(-y/s)                  where all y < 0: the logarithm of the size

A map of `surrogates.analysis.response_map` serves by its name, turned over where small values are sought:
v = s y, w = s T(s v) with s = 1 or -1.

Of the maps above the one of highest restricted likelihood of the fitted Kriging wins; the likelihood of the
transformed values is carried back to y by the log Jacobian, sum log w'(y), as for any transformation (Box and
Cox 1964).
"""

from dataclasses import dataclass, replace

import numpy as np

from .response_map import ResponseMap, admitted_scales, response_map

__all__ = ["IDENTITY", "SEARCH_SCALES", "NamedScale", "OutputTransform", "candidates", "named_scale"]

OFFSETS = (1.0, 0.1, 0.01)  # c: how hard the transform bends
SEARCH_SCALES = ("auto", "none", "log", "box-cox", "yeo-johnson")  # ranks tell nothing beyond the runs
ZERO = 1e-12  # offset of a transform that is anchored at zero: none, but for rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputTransform:
    """A monotone increasing map of the response."""

    kind: str  # identity | toward max | away
    anchor: float = 0.0  # y_max or y_min
    spread: float = 1.0
    offset: float = 1.0

    def forward(self, y: np.ndarray) -> np.ndarray:
        """W(y); values beyond the anchor are held at the offset's tenth."""
        if self.kind == "identity":
            return y
        return self._sign * self.spread * np.log(self._distance(y))

    def inverse(self, w: np.ndarray) -> np.ndarray:
        """The y of w."""
        if self.kind == "identity":
            return w
        most = 700 - max(np.log(self.spread), 0.0)  # times the spread it is a number still
        distance = np.exp(np.clip(self._sign * w / self.spread, -700, most))
        return self.anchor + self._sign * self.spread * (distance - self.offset)

    def log_jacobian(self, y: np.ndarray) -> float:
        """Sum of log w'(y)."""
        if self.kind == "identity":
            return 0.0
        return float(-np.log(self._distance(y)).sum())

    @property
    def is_anchored_at_zero(self) -> bool:
        """Whether this is the plain logarithm of -y."""
        return self.kind != "identity" and self.offset == ZERO

    def holds(self, y: np.ndarray) -> bool:
        """Whether the values y (n,) may be transformed: a plain logarithm needs y < 0."""
        return not self.is_anchored_at_zero or bool((y < 0).all())

    def anchored(self, y: np.ndarray) -> "OutputTransform":
        """The transform anchored at the values seen by now."""
        if self.kind == "identity" or self.is_anchored_at_zero:
            return self
        return replace(self, anchor=float(y.max() if self.is_towards_max else y.min()))

    @property
    def words(self) -> str:
        """What is modelled, in words."""
        if self.kind == "identity":
            return "none"
        if self.is_anchored_at_zero:
            return "the logarithm of its size"
        end = "the worst value" if self.is_towards_max else "the mildest value"
        return f"the logarithm of the distance to {end}"

    @property
    def is_towards_max(self) -> bool:
        """Whether the transform stretches the region next to the largest value."""
        return self.kind == "toward max"

    @property
    def _sign(self) -> float:
        return -1.0 if self.is_towards_max else 1.0

    def _distance(self, y: np.ndarray) -> np.ndarray:
        return np.maximum(self._sign * (y - self.anchor) / self.spread + self.offset, self.offset / 10)


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedScale:
    """A `ResponseMap` of y for the values v = sign y of a search."""

    map: ResponseMap
    sign: float

    @property
    def kind(self) -> str:
        """The name of the scale."""
        return self.map.scale

    @property
    def words(self) -> str:
        """The name with its power."""
        return self.map.words

    def forward(self, v: np.ndarray) -> np.ndarray:
        """W(v), no farther beyond the runs than the map goes back."""
        return np.asarray(self.sign * self.map.forward(np.clip(self.sign * v, *self.map.ends)))

    def inverse(self, w: np.ndarray) -> np.ndarray:
        """The v of w."""
        return np.asarray(self.sign * self.map.inverse(self.sign * w))

    def holds(self, v: np.ndarray) -> bool:
        """Whether the values v (n,) may be mapped: logarithm and Box-Cox need y > 0."""
        return self.map.scale in admitted_scales(self.sign * v)

    def anchored(self, v: np.ndarray) -> "NamedScale":
        """The same map, with the range of the values seen by now."""
        return replace(self, map=replace(self.map, observed=np.sort(self.sign * v)))


IDENTITY = OutputTransform(kind="identity")


def named_scale(scale: str, v: np.ndarray, sign: float) -> NamedScale | OutputTransform:
    """The scale of that name for the values v = sign y (n,); the identity where they do not admit it.

    >>> named_scale("log", -np.array([1.0, np.e]), -1.0).forward(-np.array([1.0, np.e]))
    array([-0., -1.])
    >>> named_scale("log", np.array([1.0, -2.0]), 1.0).kind
    'identity'
    """
    if scale == "none" or scale not in admitted_scales(sign * v):
        return IDENTITY
    return NamedScale(map=response_map(sign * v, scale), sign=sign)


def candidates(y: np.ndarray) -> list[OutputTransform]:
    """The transforms worth trying for the values y (n,): identity first, then both families."""
    low, high = np.quantile(y, [0.25, 0.75])
    spread = float(high - low) or float(y.max() - y.min())
    if spread <= 0:
        return [IDENTITY]
    toward = [
        OutputTransform(kind="toward max", anchor=float(y.max()), spread=spread, offset=c) for c in OFFSETS
    ]
    away = [OutputTransform(kind="away", anchor=float(y.min()), spread=spread, offset=c) for c in OFFSETS]
    # the logarithm of positive values would stretch the end that nobody looks for
    plain = [OutputTransform(kind="toward max", spread=spread, offset=ZERO)] if y.max() < 0 else []
    return [IDENTITY, *plain, *toward, *away]

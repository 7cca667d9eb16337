"""Monotone output transforms: a response over five decades is easier to predict after a logarithm.

For values y that are to be maximised, with spread s = upper quartile - lower quartile of y:

    identity     w = y
    toward max   w = -s log((y_max - y)/s + c)     stretches the region next to the best value
    away         w =  s log((y - y_min)/s + c)     compresses a few very large values
    plain        w = -s log(-y/s)                  where all y < 0: the logarithm of the size

The transform of highest restricted likelihood of the fitted Kriging wins; the likelihood of the transformed
values is carried back to y by the log Jacobian, sum log w'(y), as for any transformation (Box and Cox 1964).
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["IDENTITY", "OutputTransform", "candidates"]

OFFSETS = (1.0, 0.1, 0.01)  # c: how hard the transform bends
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
        distance = np.exp(np.clip(self._sign * w / self.spread, -700, 700))
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

    @property
    def is_towards_max(self) -> bool:
        """Whether the transform stretches the region next to the largest value."""
        return self.kind == "toward max"

    @property
    def _sign(self) -> float:
        return -1.0 if self.is_towards_max else 1.0

    def _distance(self, y: np.ndarray) -> np.ndarray:
        return np.maximum(self._sign * (y - self.anchor) / self.spread + self.offset, self.offset / 10)


IDENTITY = OutputTransform(kind="identity")


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

"""Linear filters of sampled signals and their transposes: channel classes, whole-body weighting.

A signal is taken as zero before its first sample and behind its last. A causal filter is a lower triangular
matrix F over the samples; backwards in time it is F^T, so slopes go back through a filter exactly.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import pi, sqrt, tan
from typing import Any, Protocol

import numpy as np
from scipy.signal import bilinear_zpk, lfilter, sosfilt, zpk2sos

__all__ = ["ChannelFilter", "SignalFilter", "WholeBodyFilter"]

Array = np.ndarray[Any, Any]


class SignalFilter(Protocol):
    """A linear filter of samples a step apart."""

    def applied(self, signal: Array, step: float) -> Array:
        """(T, ...) F x of a signal (T, ...), samples `step` s apart."""
        ...

    def transposed(self, signal: Array, step: float) -> Array:
        """(T, ...) F^T x."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelFilter:
    """Channel frequency class of SAE J211-1 (ISO 6487), without shift of phase: CFC 60, 180, 600 or 1000.

    Two poles of Butterworth forwards and once more backwards; -3 dB at about 1.65 cfc Hz. For a resultant the
    components are filtered. F is symmetric. Raises ValueError where the samples are too far apart.
    """

    cfc: float

    def _pass(self, signal: Array, step: float) -> Array:
        turn = 2.0 * pi * self.cfc * 2.0775 * step / 2.0
        if not 0.0 < turn < 0.5 * pi:
            raise ValueError(
                f"a channel filter of CFC {self.cfc:g} needs steps of 0 to "
                f"{0.25 / (self.cfc * 1.03875):.3g} s, got {step:.3g} s; take more steps or a lower class"
            )
        w = tan(turn)
        whole = 1.0 + sqrt(2.0) * w + w * w
        b = np.array([1.0, 2.0, 1.0]) * w * w / whole
        a = np.array([1.0, 2.0 * (w * w - 1.0) / whole, (1.0 - sqrt(2.0) * w + w * w) / whole])
        return np.asarray(lfilter(b, a, signal, axis=0))

    def applied(self, signal: Array, step: float) -> Array:
        """(T, ...) the filtered signal."""
        return self._pass(self._pass(signal, step)[::-1], step)[::-1]

    def transposed(self, signal: Array, step: float) -> Array:
        """(T, ...) the same: F = R B R B with B^T = R B R, R reversing time."""
        return self.applied(signal, step)


# ISO 2631-1:1997, table A.1: f3, f4 in Hz, Q4; f5 in Hz, Q5, f6 in Hz, Q6 of the upward step, if any
WEIGHTINGS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float, float] | None]] = {
    "Wk": ((12.5, 12.5, 0.63), (2.37, 0.91, 3.35, 0.91)),
    "Wd": ((2.0, 2.0, 0.63), None),
}
BAND = (0.4, 100.0)  # Hz


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeBodyFilter:
    """Frequency weighting of ISO 2631-1:1997, annex A: "Wk" for the vertical axis of a seat, "Wd" across.

        H = p^2/(p^2 + sqrt2 w1 p + w1^2) . 1/(1 + sqrt2 p/w2 + (p/w2)^2)
            . (1 + p/w3)/(1 + p/(Q4 w4) + (p/w4)^2)
            . (1 + p/(Q5 w5) + (p/w5)^2)/(1 + p/(Q6 w6) + (p/w6)^2) (w5/w6)^2

    Discretised by the bilinear rule: with steps of 1 ms within 1 % up to 31.5 Hz.
    """

    weighting: str

    def __post_init__(self) -> None:
        if self.weighting not in WEIGHTINGS:
            raise ValueError(f"weighting needs to be one of {', '.join(WEIGHTINGS)}, got '{self.weighting}'")

    def zeros_poles_gain(self) -> tuple[Array, Array, float]:
        """Of H, rad/s."""
        (f3, f4, q4), step = WEIGHTINGS[self.weighting]
        w1, w2, w3, w4 = (2.0 * pi * f for f in (*BAND, f3, f4))
        zeros = [np.zeros(2), np.array([-w3])]
        poles = [_roots(w1, sqrt(0.5)), _roots(w2, sqrt(0.5)), _roots(w4, q4)]
        gain = w2**2 * w4**2 / w3
        if step is not None:
            f5, q5, f6, q6 = step
            zeros.append(_roots(2.0 * pi * f5, q5))
            poles.append(_roots(2.0 * pi * f6, q6))
        # the step's own gain, (w6/w5)^2 in this form, meets the factor (w5/w6)^2
        return np.concatenate(zeros), np.concatenate(poles), gain

    def _pass(self, signal: Array, step: float) -> Array:
        return np.asarray(sosfilt(_sections(self, step), signal, axis=0))

    def applied(self, signal: Array, step: float) -> Array:
        """(T, ...) the weighted signal, causal."""
        return self._pass(signal, step)

    def transposed(self, signal: Array, step: float) -> Array:
        """(T, ...) the same backwards in time."""
        return self._pass(signal[::-1], step)[::-1]


@lru_cache(maxsize=64)
def _sections(weighting: WholeBodyFilter, step: float) -> Array:
    """(k, 6) second-order sections of H: as costly as what they filter."""
    return np.asarray(zpk2sos(*bilinear_zpk(*weighting.zeros_poles_gain(), 1.0 / step)))


def _roots(w: float, q: float) -> Array:
    """Roots of p^2 + (w/q) p + w^2."""
    return np.roots([1.0, w / q, w * w])

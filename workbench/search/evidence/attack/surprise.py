"""Which drawn cases stand out of a plain trend: the flank of a narrow peak looks like nothing but this.

    surprise = (value - trend) / scale,    trend: quadratic without interactions, by ridge regression,
                                           scale: 1.48 times the median of the sizes of the residuals

Where a response is smooth the largest surprise of a hundred cases is a few scales; a needle, a jump or a
resonance leaves a case far above its like long before a case on its top is met. There an adversary climbs.
"""

import numpy as np

__all__ = ["surprises"]

RIDGE = 1e-3  # of the mean square of a centred column: cases may be fewer than columns


def surprises(features: np.ndarray, values: np.ndarray) -> np.ndarray:
    """How far each value (n,) stands above the trend over the features (n, p), in scales.

    Minus infinity where there is no value, and everywhere where there are fewer than three.

    >>> u = np.linspace(0, 1, 41)
    >>> int(np.argmax(surprises(u[:, None], u**2 + 0.2 * (np.arange(41) == 13))))
    13
    """
    out = np.full(len(values), -np.inf)
    ok = np.isfinite(values)
    if ok.sum() < 3:
        return out
    v = values[ok]
    columns = np.hstack([features, (features - 0.5) ** 2])[ok]
    columns = columns - columns.mean(axis=0)
    centred = v - v.mean()
    gram = columns.T @ columns
    weight = RIDGE * max(np.trace(gram) / len(gram), 1e-12)
    fit = columns @ np.linalg.solve(gram + weight * np.eye(len(gram)), columns.T @ centred)
    residual = centred - fit
    scale = 1.48 * float(np.median(np.abs(residual)))
    out[ok] = residual / scale if scale > 0 else np.where(residual > 0, np.inf, 0.0)
    return out

"""Morris runs reused: elementary effects first, then the likelihood on the same runs.

Elementary effects need d + 1 runs per trajectory, give no predictor and no number of active inputs. The
same runs are data for a Kriging screener, which gives both. They lie on few levels and along trajectories,
which is a poor design for a Kriging model, so a few space-filling runs beside them help; they may be
passed along.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .morris import MorrisEffects, morris_effects
from .response_scale import judged_on_response, on_scale
from .screener import KrigingScreener

__all__ = ["HybridScreening", "hybrid_screening"]


@dataclass(frozen=True, slots=True, kw_only=True)
class HybridScreening:
    """Both views of the same runs.

    Attributes:
        morris: the elementary effects.
        screener: fitted on all runs.
        agreed: inputs selected by the screener that are also among as many first of the Morris ranking.
        disputed: inputs in one of the two and not in the other.
    """

    morris: MorrisEffects
    screener: KrigingScreener
    agreed: tuple[int, ...]
    disputed: tuple[int, ...]


def hybrid_screening(
    points: ArrayLike,
    y: ArrayLike,
    *,
    screener: KrigingScreener | None = None,
    run_at: ArrayLike | None = None,
    more_points: ArrayLike | None = None,
    more_y: ArrayLike | None = None,
    scale: str = "none",
) -> HybridScreening:
    """Screen runs on `morris_points`, and further runs if there are any.

    Args:
        points, y: whole trajectories (n, d), and their responses.
        screener: what screens; say there which columns are `categorical`.
        run_at: (n, d) where the runs were made, where levels or labels move them away from `points`.
        more_points, more_y: further runs, in the coordinates of `run_at`.
        scale: on which the likelihood screens all runs, one of RESPONSE_SCALES; the verdict is judged on the
            response, and elementary effects are those of the response.

    >>> from surrogates.screening.morris import morris_points
    >>> x = morris_points(5, 4, rng=np.random.default_rng(0))
    >>> hybrid_screening(x, 3 * x[:, 1] + x[:, 4] ** 2).agreed
    (1, 4)
    """
    x, y = np.asarray(points, dtype=float), np.asarray(y, dtype=float)
    effects = morris_effects(x, y)
    if run_at is not None:
        x, given = np.asarray(run_at, dtype=float), x.shape
        if x.shape != given:
            raise ValueError(f"run_at needs the shape of points, {given}, got {x.shape}")
    if (more_points is None) != (more_y is None):
        raise ValueError("more_points and more_y belong together: give both or none")
    if more_points is not None and more_y is not None:
        x = np.vstack([x, np.asarray(more_points, dtype=float)])
        y = np.concatenate([y, np.asarray(more_y, dtype=float)])
    fitted = (KrigingScreener() if screener is None else screener).fit(x, on_scale(y, scale))
    judged_on_response(fitted, x, y, scale)
    chosen = [int(k) for k in fitted.selected_]
    first = set(effects.ranking[: len(chosen)].tolist())
    return HybridScreening(
        morris=effects,
        screener=fitted,
        agreed=tuple(k for k in chosen if k in first),
        disputed=tuple(sorted(set(chosen) ^ first)),
    )

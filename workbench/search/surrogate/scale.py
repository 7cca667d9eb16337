"""On which scale a search modelled its response, and why."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from workbench.search.surrogate.model import SearchModel

__all__ = ["UsedScale", "used_scale"]

KRIGING = "the Kriging of all parameters"  # that of a screening is of the selected ones


@dataclass(frozen=True, slots=True, kw_only=True)
class UsedScale:
    """`asked`: a name of SEARCH_SCALES; `used`: the scale of the last model; `reason`: a sentence.

    `unexplained`: squared error of left-out runs, carried back, over the variance of the response.
    """

    asked: str
    used: str
    reason: str
    unexplained: float | None

    def to_dict(self) -> dict[str, Any]:
        """As in `worst_case.json`."""
        return asdict(self)


def used_scale(asked: str, model: SearchModel, v: np.ndarray) -> UsedScale:
    """What the last model of a search, of values v (n,), was made on."""
    used = model.transform.words
    unexplained = _unexplained(model, v)
    if asked not in ("auto", "none") and used == "none":
        reason = f"The response was modelled as it is: {asked!r} needs it above 0, and a run is not."
    elif used == "none":
        why = "" if asked == "none" else ": no other scale made the runs clearly likelier"
        reason = f"The response was modelled as it is{why}."
    elif asked == "auto":
        reason = (
            f"Modelled was {used}, which makes the runs likelier than the response itself does (by "
            f"{model.likelier_by:.1f} in log-likelihood)."
        )
    else:
        reason = f"Modelled was the response on the scale {used}, as asked."
    if unexplained is not None and unexplained >= 1.0:
        reason += f" Where runs are left out {KRIGING} explains none of the response's variance."
    elif unexplained is not None:
        share = f"{100 * unexplained:.3g} % of the response's variance"
        reason += f" Where runs are left out {KRIGING} leaves {share} unexplained."
    return UsedScale(asked=asked, used=used, reason=reason, unexplained=unexplained)


def _unexplained(model: SearchModel, v: np.ndarray) -> float | None:
    left, spread = model.kriging.leave_one_out(), float(v.var())
    usable = np.isfinite(left.std)
    if spread <= 0.0 or not usable.any():
        return None
    error = v[usable] - model.transform.inverse(left.prediction[usable])
    return float((error**2).mean()) / spread

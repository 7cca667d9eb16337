"""The scale on which a response is screened, chosen or named, and in words."""

import numpy as np

from surrogates import KrigingScreener, choose_scale
from surrogates.analysis.response_map import admitted_scales
from workbench.errors import StudyError

__all__ = ["SCALES_IN_WORDS", "chosen_scale"]

SCALES_IN_WORDS = {
    "none": "",
    "log": "the logarithm of the response",
    "ranks": "the ranks of the response",
    "box-cox": "a power of the response (Box-Cox)",
    "yeo-johnson": "a power of the response (Yeo-Johnson)",
}


def chosen_scale(
    screener: KrigingScreener, x: np.ndarray, y: np.ndarray, transform: str, response: str
) -> tuple[str, str]:
    """The scale to screen on, and why where it was chosen."""
    if transform == "auto":
        choice = choose_scale(screener, x, y)
        return choice.scale, f" ({choice.reason})"
    if transform not in admitted_scales(y):
        raise StudyError(
            f"screening transform {transform!r} needs {response!r} above 0 in all runs, got {y.min():g}: "
            "take 'ranks'"
        )
    return transform, ""

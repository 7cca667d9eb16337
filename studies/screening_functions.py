"""Published functions on which screenings are compared: each on the unit cube, its active inputs known.

An input counts as active when its total Sobol' index exceeds one percent. Functions of fewer inputs get
inert ones, so that all have twenty.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.welch20 import NAMES, welch20

__all__ = ["FUNCTIONS", "ScreeningFunction"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreeningFunction:
    """A function (n, 20) -> (n,), the columns that are active, where it is from and what is hard about it."""

    evaluate: Callable[[Array], Array]
    active: tuple[int, ...]
    source: str
    character: str


def _welch(x: Array) -> Array:
    return np.array([welch20(**dict(zip(NAMES, row, strict=True))) for row in (x - 0.5).tolist()])


def _friedman(x: Array) -> Array:
    return np.asarray(
        10 * np.sin(np.pi * x[:, 0] * x[:, 1]) + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]
    )


def _ishigami(x: Array) -> Array:
    z = np.pi * (2 * x[:, :3] - 1)
    return np.asarray(np.sin(z[:, 0]) + 7 * np.sin(z[:, 1]) ** 2 + 0.1 * z[:, 2] ** 4 * np.sin(z[:, 0]))


def _sobol_g(x: Array) -> Array:
    a = np.array([0.0, 1.0, 4.5, *[99.0] * 17])
    return np.asarray(np.prod((np.abs(4 * x - 2) + a) / (1 + a), axis=1))


def _waves(x: Array) -> Array:
    return np.asarray(np.sin(x[:, 0]) + np.sin(5 * x[:, 1]))


def _halving(x: Array) -> Array:
    return np.asarray(x[:, :8] @ (0.2 / 2.0 ** np.arange(8)))


FUNCTIONS: dict[str, ScreeningFunction] = {
    "welch": ScreeningFunction(
        evaluate=_welch,
        active=(0, 3, 4, 11, 18, 19),
        source="Welch et al., Technometrics 34 (1992); eq. (3.14)",
        character="one input acts through an interaction only, one is small and linear, one cubic",
    ),
    "friedman": ScreeningFunction(
        evaluate=_friedman,
        active=(0, 1, 2, 3, 4),
        source="Friedman, Ann. Stat. 19 (1991)",
        character="smooth, one strong interaction, one pure square",
    ),
    "ishigami": ScreeningFunction(
        evaluate=_ishigami,
        active=(0, 1, 2),
        source="Ishigami & Homma, ISUMA (1990)",
        character="several waves in each input, one input acts through an interaction only",
    ),
    "sobol-g": ScreeningFunction(
        evaluate=_sobol_g,
        active=(0, 1, 2),
        source="Saltelli & Sobol', Reliab. Eng. Syst. Saf. 50 (1995), a = (0, 1, 4.5, 99, ..., 99)",
        character="kinks in the middle of every input, multiplicative",
    ),
    "waves": ScreeningFunction(
        evaluate=_waves,
        active=(0, 1),
        source="Linkletter et al., Technometrics 48 (2006), sinusoidal example",
        character="additive, one nearly linear and one wavy input",
    ),
    "halving": ScreeningFunction(
        evaluate=_halving,
        active=(0, 1, 2, 3),
        source="Linkletter et al., Technometrics 48 (2006), decreasing coefficients",
        character="linear, coefficients halve from input to input: no gap between active and inert",
    ),
}

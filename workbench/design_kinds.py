"""From a space, a kind and a number of runs to unit points: the `[design]` table of a study.

Every kind is one function of `doe` on the unit cube; the options it takes are listed in `KINDS`, and an
option that a kind does not take is refused.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.space import Space

__all__ = ["KINDS", "DesignOptions", "points_of_kind"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """What a kind may be asked for; None leaves the kind's own default.

    criterion: phi_p | cd2 | maxpro | correlation (optimised_lhs)    swaps: number of swaps (optimised_lhs,
    d_optimal_within)    duplication, target: see `doe.ihs`    model: linear | interactions | quadratic
    pool: candidates of d_optimal_select    levels: per continuous parameter (grid, factorial)
    """

    criterion: str | None = None
    swaps: int | None = None
    duplication: int | None = None
    target: str | None = None
    model: str | None = None
    pool: int | None = None
    levels: int | None = None

    def given(self) -> dict[str, Any]:
        """The options that are set."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}


# kind -> options it takes
KINDS: dict[str, tuple[str, ...]] = {
    "lhs": (),
    "optimised_lhs": ("criterion", "swaps"),
    "ihs": ("duplication", "target"),
    "d_optimal_select": ("model", "pool"),
    "d_optimal_within": ("model", "swaps"),
    "sobol": (),
    "halton": (),
    "grid": ("levels",),
}


def points_of_kind(
    space: Space, kind: str, runs: int | None, *, rng: np.random.Generator, options: DesignOptions
) -> tuple[np.ndarray, dict[str, Any]]:
    """Unit points (n, d) of a kind and the options that were used."""
    if kind not in KINDS:
        raise StudyError(f"design kind needs one of {', '.join(KINDS)}, got {kind!r}")
    given = options.given()
    stray = [name for name in given if name not in KINDS[kind]]
    if stray:
        takes = ", ".join(KINDS[kind]) or "no options"
        raise StudyError(f"design kind {kind!r} does not take {stray[0]!r}; it takes {takes}")
    if kind == "grid":
        return grid(space, runs, levels=options.levels), given
    if runs is None or runs < 1:
        raise StudyError(f"design kind {kind!r} needs runs >= 1, got {runs}")
    d = space.dimension
    if kind in ("sobol", "halton"):
        from scipy.stats import qmc

        sequence = qmc.Sobol(d, rng=rng) if kind == "sobol" else qmc.Halton(d, rng=rng)
        points = _sobol(sequence, runs) if isinstance(sequence, qmc.Sobol) else sequence.random(runs)
    else:
        points = getattr(doe, kind)(runs, d, rng=rng, **given)
    return np.ascontiguousarray(space.snap(points)), given


def _sobol(sequence: Any, runs: int) -> np.ndarray:
    """The first `runs` points; drawn up to the next power of two, which Sobol' balance needs."""
    return np.asarray(sequence.random_base2(max(runs - 1, 0).bit_length()))[:runs]


def grid(space: Space, runs: int | None, *, levels: int | None) -> np.ndarray:
    """All combinations: every level of a levelled parameter, `levels` even steps of a continuous one."""
    d = space.dimension
    axes = []
    for own in space.unit_levels:
        if own is None and levels is None:
            if runs is None:
                raise StudyError("design kind 'grid' needs levels, the number per continuous parameter")
            levels = max(1, int(runs ** (1.0 / d) + 1e-9))
        axes.append(own if own is not None else np.linspace(0.0, 1.0, levels or 1))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, d)

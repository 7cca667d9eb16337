"""The kinds of designs: one table that the schema of a study, `make_design`, help and docs read.

A kind names a function of `doe` and the way its points reach the factors of a study (`points.py`). A sampler
that goes one of the ways is one entry here. Nothing heavy is imported, so that help and schema stay quick.
"""

from dataclasses import dataclass, field, fields
from typing import Any, Literal

__all__ = ["DEFAULT", "KINDS", "SPREAD", "DesignKind", "DesignOptions", "Way"]

# spread: points of a sampler, put on the levels; sequence: the first feasible points of a scrambled sequence;
# arranged: swaps on the levels themselves; within: swaps that stay a Latin hypercube; chosen: rows of a pool
# of feasible points; grid, factorial: all combinations; classical: a table that fixes its number of runs
Way = Literal["spread", "sequence", "arranged", "within", "chosen", "grid", "factorial", "classical"]
# ways that fill the space; the others are made for a regression and may lie anywhere
SPREAD: tuple[Way, ...] = ("spread", "sequence", "arranged", "within")

DEFAULT = "optimised_lhs"  # of a study that names no kind


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """What a kind may be asked for; None leaves the kind's own default.

    criterion: phi_p | cd2 | maxpro | correlation, or several with commas (optimised_lhs), D | A | I (optimal)
    swaps: swaps tried (optimised_lhs, d_optimal_within)    duplication, target: see `doe.ihs`
    model: linear | interactions | quadratic    pool: candidates (d_optimal_select, optimal)
    levels: per continuous parameter (grid, factorial)    resolution: of a fractional design
    alpha: axial distance of a central composite design    centre: runs in the middle

    A whole number is at least 1, or what its field says in `metadata["least"]`.
    """

    criterion: str | None = None
    swaps: int | None = None
    duplication: int | None = None
    target: str | None = None
    model: str | None = None
    pool: int | None = None
    levels: int | None = None
    resolution: int | None = None
    alpha: str | None = None
    centre: int | None = field(default=None, metadata={"least": 0})

    def given(self) -> dict[str, Any]:
        """The options that are set."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignKind:
    """A kind of `[design]`.

    function: its name in `doe`, or in scipy.stats.qmc for a sequence    options: those it takes
    summary: what it is, for help and docs
    """

    way: Way
    function: str
    summary: str
    options: tuple[str, ...] = ()

    @property
    def needs_runs(self) -> bool:
        """Whether the number of runs is ours to say: grids and tables know their own."""
        return self.way not in ("grid", "factorial", "classical")


KINDS: dict[str, DesignKind] = {
    "lhs": DesignKind(way="spread", function="lhs", summary="a random Latin hypercube"),
    "optimised_lhs": DesignKind(
        way="arranged",
        function="centred_lhs",
        options=("criterion", "swaps"),
        summary="a Latin hypercube after swaps for phi_p, cd2 and correlation, or those named (maxpro)",
    ),
    "ihs": DesignKind(
        way="spread",
        function="ihs",
        options=("duplication", "target"),
        summary="improved hypercube sampling, as published",
    ),
    "d_optimal_select": DesignKind(
        way="chosen",
        function="exchange",
        options=("model", "pool"),
        summary="the D-optimal rows of a pool of feasible points",
    ),
    "d_optimal_within": DesignKind(
        way="within",
        function="d_optimal_within",
        options=("model", "swaps"),
        summary="a Latin hypercube that swaps inside its columns made D-optimal",
    ),
    "optimal": DesignKind(
        way="chosen",
        function="exchange",
        options=("model", "criterion", "pool"),
        summary="as d_optimal_select, for the criterion D, A or I",
    ),
    "sobol": DesignKind(way="sequence", function="Sobol", summary="a scrambled Sobol' sequence"),
    "halton": DesignKind(way="sequence", function="Halton", summary="a scrambled Halton sequence"),
    "grid": DesignKind(
        way="grid",
        function="full_factorial",
        options=("levels",),
        summary="all combinations of even steps; at most `runs` of them where no levels are given",
    ),
    "factorial": DesignKind(
        way="factorial",
        function="full_factorial",
        options=("levels",),
        summary="all combinations of the levels, two of a continuous parameter",
    ),
    "fractional": DesignKind(
        way="classical",
        function="two_level_fraction",
        options=("resolution",),
        summary="a fraction of the two-level factorial, of a resolution",
    ),
    "plackett_burman": DesignKind(
        way="classical", function="plackett_burman", summary="two levels, main effects in the fewest runs"
    ),
    "central_composite": DesignKind(
        way="classical",
        function="central_composite",
        options=("alpha", "centre"),
        summary="corners, axes and centre for a quadratic",
    ),
    "box_behnken": DesignKind(
        way="classical",
        function="box_behnken",
        options=("centre",),
        summary="three levels for a quadratic, no corners",
    ),
}

"""The kinds of designs: one table that the schema of a study, `make_design`, help and docs read.

What a table `[design]` may ask of them is checked here too, before anything is drawn.

A kind names a function of `doe` and the way its points reach the factors of a study (`points.py`). A sampler
that goes one of the ways is one entry here. Nothing heavy is imported, so that help and schema stay quick.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any, Literal

from workbench.errors import StudyError

__all__ = [
    "DEFAULT",
    "KINDS",
    "MOST_UP_TO",
    "SPREAD",
    "DesignKind",
    "DesignOptions",
    "Way",
    "check_kind",
    "checked_up_to",
]

# spread: points of a sampler, put on the levels; sequence: the first feasible points of a scrambled sequence;
# arranged: swaps on the levels themselves; within: swaps that stay a Latin hypercube; chosen: rows of a pool
# of feasible points; grid, factorial: all combinations; classical: a table that fixes its number of runs
Way = Literal["spread", "sequence", "arranged", "within", "chosen", "grid", "factorial", "classical"]
# ways that fill the space; the others are made for a regression and may lie anywhere
SPREAD: tuple[Way, ...] = ("spread", "sequence", "arranged", "within")

MOST_UP_TO = 2_000  # runs of which a part is chosen: tables of their pairs are made
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


def check_kind(kind: str, *, runs: int | None, options: Iterable[str]) -> None:
    """Refuse a kind that is not there, an option that it does not take, and no runs where it needs them.

    options: names of those that are given    Raises: StudyError.
    """
    if kind not in KINDS:
        raise StudyError(f"design kind needs one of {', '.join(KINDS)}, got {kind!r}")
    takes = KINDS[kind].options
    stray = next((name for name in options if name not in takes), None)
    if stray is not None:
        shown = ", ".join(takes) or "no options"
        raise StudyError(f"design kind {kind!r} does not take {stray!r}; it takes {shown}")
    if runs is not None and not isinstance(runs, Real):
        raise StudyError(f"design kind {kind!r} needs a whole number of runs, got {runs!r}")
    if KINDS[kind].needs_runs and (runs is None or runs < 1):
        raise StudyError(f"design kind {kind!r} needs runs >= 1, got {runs}")


def checked_up_to(table: Mapping[str, Any]) -> int | None:
    """`up_to` of a table `[design]`: the runs that the design is drawn for; None where it is not given.

    Raises: StudyError where it is fewer than `runs` or more than MOST_UP_TO, or its kind does not fill the
    space.
    """
    up_to: int | None = table.get("up_to")
    if up_to is None:
        return None
    kind, runs = table["kind"], table.get("runs")
    if kind not in KINDS or KINDS[kind].way not in SPREAD:
        filling = ", ".join(name for name, k in KINDS.items() if k.way in SPREAD)
        raise StudyError(f"[design] up_to goes with kinds that fill the space ({filling}), not with {kind!r}")
    if runs is None or not runs <= up_to <= MOST_UP_TO:
        raise StudyError(
            f"[design] up_to needs runs or more, at most {MOST_UP_TO}; got {up_to}, runs = {runs}"
        )
    return up_to

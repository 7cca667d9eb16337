"""The layouts of section 8.6: found, described as the text describes its own, and drawn as matrices.

    python -m studies.gunner.restraints.chapter [folder]

prints a table of values and one of what the text says of layer, side and part of the torso, and writes the
matrices (the source's own are images, so single members cannot be compared).
"""

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.engine import optimise_layout
from workbench.engine.layout.formulation.problem import FAILURES
from workbench.engine.layout.outcome.result import LayoutResult

from .designs import DESIGNS, STEP, Design, Place, layout_problem, places, value_of
from .ground_structure import sites

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SAID", "Found", "Said", "agreement", "figures", "find", "main", "shares"]

Array = np.ndarray[Any, Any]
ALL = 0.9  # of a layout's sum: "all remaining members"
NOTHING = 0.05  # of a budget: so little is no layout


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """A sentence of the text on a layout: all members of some kinds satisfy `holds`, or most have `most`.

    most: what is compared, for example the side, and which of them has the largest sum.
    """

    words: str
    of: str = ""
    holds: Callable[[Place], bool] | None = None
    most: tuple[Callable[[Place], Any], Any] | None = None


def _side(place: Place) -> str:
    return place.site.side


def _not(side: str) -> Callable[[Place], bool]:
    return lambda place: place.site.side != side


def _top(place: Place) -> bool:
    return place.site.layer == 1


def _off(segment: str) -> Callable[[Place], bool]:
    return lambda place: place.site.segment != segment


_LEFT_UPPER = (
    Said(words="on the left side", holds=lambda p: p.site.side == "left"),
    Said(words="on the upper torso", holds=lambda p: p.site.segment == "upper torso"),
)
SAID: Mapping[str, tuple[Said, ...]] = {
    "(8.29)": (
        Said(words="in the highest layer", holds=_top),
        Said(words="left, right and back", holds=_not("front")),
        Said(words="on central and lower torso", holds=_off("upper torso")),
    ),
    "(8.30)": (
        Said(words="in the highest layer", holds=_top),
        Said(words="front, back and right", holds=_not("left")),
        Said(words="right most", most=(_side, "right")),
        Said(words="on central and lower torso", holds=_off("upper torso")),
    ),
    "(8.31)": _LEFT_UPPER,
    "(8.32)": (
        Said(words="belts alone", holds=lambda p: p.kind == "belt"),
        Said(words="belts in the highest layer", of="belt", holds=_top),
        Said(words="belts at the back most", of="belt", most=(_side, "back")),
    ),
    "(8.33)": (
        Said(words="belts in the highest layer", of="belt", holds=_top),
        Said(words="belts at the back most", of="belt", most=(_side, "back")),
        Said(words="airbags in lower layers", of="airbag", holds=lambda p: p.site.layer > 1),
        Said(words="airbags in front most", of="airbag", most=(_side, "front")),
        Said(words="airbags on upper and central torso", of="airbag", holds=_off("lower torso")),
    ),
    "(8.34)": (Said(words="all fire at 1.5 s", holds=lambda p: p.at == 1.5), *_LEFT_UPPER),
    "(8.36)": _LEFT_UPPER,
    "(8.37)": (),
}  # of (8.37) the text says that no clear layout came out


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A layout of section 8.6: its variables, densities of these alone, and how good it is.

    nothing, uniform: value without members and with the budgets spread evenly; value: found; finer: the same
    at half the step; m, see `value_of`, nan where that cannot be simulated.
    error: first-order error, relative to the objective.
    """

    design: Design
    places: tuple[Place, ...]
    density: Array
    nothing: float
    uniform: float
    value: float
    finer: float
    error: float
    result: LayoutResult


def find(
    designs: Iterable[Design] = DESIGNS, *, evaluations: int | None = None, step: float = STEP,
    seen: Callable[[Found], None] | None = None,
) -> dict[str, Found]:  # fmt: skip
    """The layouts, in order: those that are kept stand before those that keep them.

    evaluations: of each, None for its own number.  seen: called with each as it is found. Raises KeyError for
    a design that keeps one that was not asked for.
    """
    found: dict[str, Found] = {}
    for design in designs:
        kept = None if design.keeps is None else (found[design.keeps].places, found[design.keeps].density)
        problem, some = layout_problem(design, kept, step=step), places(design)
        none, even = (
            np.r_[share * problem.start[: len(some)], problem.start[len(some) :]]
            for share in (0.0, 1.0 / design.first)
        )
        result = optimise_layout(problem, max_evaluations=evaluations or design.evaluations)
        finer = layout_problem(design, kept, step=0.5 * step)

        def look(problem: Any, density: Array, design: Design = design) -> float:
            try:
                return value_of(design, float(problem.evaluate(density).values.max()))
            except FAILURES:
                return float("nan")

        found[design.name] = Found(
            design=design, places=some, density=np.asarray(result.density[: len(some)]),
            nothing=look(problem, none), uniform=look(problem, even),
            value=value_of(design, result.value), finer=look(finer, result.density), error=result.kkt,
            result=result,
        )  # fmt: skip
        if seen is not None:
            seen(found[design.name])
    return found


def shares(found: Found, of: Callable[[Place], Any], kind: str = "") -> dict[Any, float]:
    """Shares of the sum of densities by what a function tells of a place, the largest first."""
    sums: dict[Any, float] = {}
    for place, density in zip(found.places, found.density, strict=True):
        if kind in ("", place.kind):
            sums[of(place)] = sums.get(of(place), 0.0) + float(density)
    whole = sum(sums.values())
    if whole == 0.0:
        return {}
    return {key: value / whole for key, value in sorted(sums.items(), key=lambda item: -item[1]) if value > 0}


def agreement(found: Found) -> list[tuple[str, float, bool]]:
    """What the text says: its words, our share, and whether ours agrees.

    A sentence on a kind of which nothing is left does not hold.
    """
    told = []
    for said in SAID[found.design.name]:
        own = [a for p, a in zip(found.places, found.density, strict=True) if said.of in ("", p.kind)]
        empty = sum(own) < NOTHING
        if said.most is not None:
            of, which = said.most
            parts = shares(found, of, said.of)
            share = parts.get(which, 0.0)
            agrees = bool(parts) and next(iter(parts)) == which
        else:
            assert said.holds is not None
            share = shares(found, said.holds, said.of).get(True, 0.0)
            agrees = share >= ALL
        told.append((said.words, share, agrees and not empty))
    return told


def lines(found: Found) -> list[str]:
    """A row of the table, then what can be said of the layout."""
    d, r = found.design, found.result
    full, some = int((found.density > 0.99).sum()), int((found.density > 0.01).sum())
    out = [
        f"{d.name} {d.on:8} {d.goal:10} {d.window[0]:g}-{d.window[1]:g} s  none {found.nothing:.4f}  uniform "
        f"{found.uniform:.4f}  ours {found.value:.4f}  half the step {found.finer:.4f} m  first-order error "
        f"{100 * found.error:.2f} %  {r.evaluations} evaluations  {r.status.name}  {some}, {full} full"
    ]
    for kind in dict.fromkeys(place.kind for place in found.places):
        used = sum(a for p, a in zip(found.places, found.density, strict=True) if p.kind == kind)
        told = "; ".join(
            ", ".join(f"{key} {100 * share:.0f} %" for key, share in shares(found, of, kind).items())
            for of in (lambda p: f"layer {p.site.layer}", _side, lambda p: p.site.segment, lambda p: p.at)
        )
        out.append(f"    {kind}: sum {used:.2f}; {told}")
    for words, share, agrees in agreement(found):
        out.append(f"    text: {words:40} ours {100 * share:5.1f} %  {'agrees' if agrees else 'differs'}")
    return out


def figures(found: Mapping[str, Found]) -> dict[str, "Figure"]:
    """Matrices in the form of figures 8.27 and 8.47: points of the torso by points of the vehicle."""
    from matplotlib.figure import Figure

    rows = sorted({s.gunner_point for s in sites()})
    label = {s.gunner_point: f"{s.gunner_point} {s.segment.split()[0]} {s.side}" for s in sites()}
    columns = sorted({(s.layer, s.vehicle_point) for s in sites()})
    panels = [(f, kind, at) for f in found.values() for kind, at in f.design.opens]
    figure = Figure(figsize=(12.0, 1.9 * ((len(panels) + 1) // 2)), layout="constrained")
    axes = np.atleast_1d(figure.subplots((len(panels) + 1) // 2, 2)).ravel()
    for ax, (one, kind, at) in zip(axes, panels, strict=False):
        table = np.full((len(rows), len(columns)), np.nan)
        for place, density in zip(one.places, one.density, strict=True):
            if (place.kind, place.at) == (kind, at):
                cell = columns.index((place.site.layer, place.site.vehicle_point))
                table[rows.index(place.site.gunner_point), cell] = density
        ax.imshow(table, aspect="auto", vmin=0.0, vmax=1.0, cmap="Blues")
        ax.set_title(f"{one.design.name} {kind}s" + (f", {at:g} s" if at else ""), fontsize=8)
        ax.set_yticks(range(len(rows)), [label[row] for row in rows], fontsize=5)
        ax.set_xticks([8 * i + 3.5 for i in range(5)], [f"layer {i + 1}" for i in range(5)], fontsize=6)
        for edge in range(1, 5):
            ax.axvline(8 * edge - 0.5, color="0.6", linewidth=0.6)
    for ax in axes[len(panels) :]:
        ax.axis("off")
    return {"gunner_layouts": figure}


def main() -> None:
    """Find all, print them as they come, and save the matrices."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    found = find(seen=lambda one: print("\n".join(lines(one)), flush=True))
    told = [agrees for one in found.values() for _, _, agrees in agreement(one)]
    print(f"{sum(told)} of {len(told)} sentences of the text hold for ours")
    for name, picture in figures(found).items():
        picture.savefig(folder / f"{name}.png", dpi=100)


if __name__ == "__main__":
    main()

"""The layouts of a finished loop of the gunner's restraints, tried by an outsider; who stays in the hatch.

    python -m studies.gunner_outsider study.toml [runs against the robust layout] [seed]
        [--rivals runs against each rival] [--box independent cases] [--corners evaluations] [--coarse]

The study's campaign stands beside it. The robust layout, the one of the nominal case and the uniform one are
run in the same independent cases of the box, from which the share of cases follows in which the gunner is
retained; then the outsider of `studies.loop_claims` searches for a worse case for each, unless told otherwise
with a quarter of the runs for a rival. All are judged over all cases that the loop or the outsider found for
any of them. Retained: `ejected` is 0, he never rose above the hatch. No surrogate, seed or case of the loop
is used. With `--corners` the plainest rival stands beside: the nominal case and 50 random corners at once,
from the layout of the nominal case, with so many evaluations. With `--coarse` the outsider searches at the
model's longer step, where a run costs a third, and the worst case that he meets is run truly.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from studies.loop_claims import outsider, runs_of_an_outsider
from studies.loop_rivals import CORNERS, Runs, drawn_case
from workbench.engine.layout.optimise import optimise_layout
from workbench.errors import StudyError
from workbench.robust_layout.model import LayoutModel, load_layout_model
from workbench.search.evidence.attack.share import Share, counted_share
from workbench.space.box import Space
from workbench.study.loading import load_study
from workbench.system.atomic import read_json

__all__ = [
    "AT_ONCE", "LAYOUTS", "AtLongerStep", "Tried", "corners_at_once", "lines", "loop_of", "main", "tried",
]  # fmt: skip

Array = np.ndarray[Any, Any]
Case = Mapping[str, Any]

LAYOUTS = ("robust", "nominal only", "uniform")
AT_ONCE = f"{CORNERS} corners"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """What became of a layout of a loop.

    stated: the loop's own worst.  met: the worst that the outsider met.  over_all: the worst over all cases
    that anybody found for any layout.  of_the_box: the share of independent cases in which he is retained;
    worst_of_the_box: of these.  cases: in how many of all cases found he is retained, and how many there are.
    runs: of all layouts so far.
    """

    name: str
    stated: float
    met: float
    over_all: float
    of_the_box: Share
    worst_of_the_box: float
    cases: tuple[int, int]
    runs: int

    @property
    def beyond(self) -> float:
        """By which share the outsider went beyond the loop's worst."""
        return max(0.0, self.met / self.stated - 1.0)


@dataclass(frozen=True, slots=True)
class AtLongerStep:
    """Runs of layouts at the model's longer step, for a search whose end is run truly."""

    runs: Runs

    def values(self, density: Array, rows: Sequence[Case]) -> Array:
        """The response of a layout in these cases, minus infinity where it fails."""
        return self.runs.read(self.runs.coarse(density)(rows, purpose="study"))


def loop_of(study_file: Path) -> tuple[LayoutModel, Space, Mapping[str, Any]]:
    """The layout model of a study, its uncertainty, and what its loop wrote.

    Raises StudyError for a study without a loop, and where that has not ended.
    """
    study = load_study(str(study_file))
    table = study.robust_layout
    if table is None:
        raise StudyError(f"{study_file.name} has no [robust_layout]: there is no layout to try")
    folder = study_file.with_suffix(".holdfast")
    found = read_json(folder / "robust_layout.json")
    if found is None:
        raise StudyError(f"no robust layout in {folder}: run `holdfast run {study_file.name}` first")
    model = load_layout_model(table["model"], table["options"], folder=study.folder)
    return model, study.space, found


def corners_at_once(
    model: LayoutModel, space: Space, loop: Mapping[str, Any], *, evaluations: int, seed: int
) -> tuple[Array, float]:
    """The layout for the nominal case and random corners, all at once, and its worst deviation over them."""
    rng = np.random.default_rng([seed, 50])
    cases = [dict(loop["cases"][0]), *(drawn_case(space, rng, corner=True) for _ in range(CORNERS))]
    start = np.array(loop["layouts"]["nominal only"]["density"])
    found = optimise_layout(
        replace(model.problem(cases), start=start), max_evaluations=evaluations, multi_start=False,
        compare=False, probes=0,
    )  # fmt: skip
    return found.density, model.as_response(found.value)


def tried(
    model: LayoutModel, space: Space, loop: Mapping[str, Any], *, budget: int, seed: int,
    rivals: int | None = None, of_the_box: int | None = None, corners: int = 0, coarse: bool = False,
    tell: Callable[[str], None] = lambda text: None,
) -> list[Tried]:  # fmt: skip
    """The layouts of a loop, each in independent cases and against the outsider.

    budget: runs of his against the robust layout. rivals, of_the_box: against each other one, and independent
    cases; None for a quarter of it. corners: evaluations for the layout of `corners_at_once`; 0 for none.
    coarse: his runs are at the model's longer step, but for the worst.
    """
    runs, rng = Runs(model), np.random.default_rng([seed, 5])
    rivals, of_the_box = (budget // 4 if n is None else n for n in (rivals, of_the_box))
    table = space.quantile(rng.random((of_the_box, space.dimension)))
    box: list[Case] = [space.canonical(dict(zip(space.names, row, strict=True))) for row in table.tolist()]
    cases: list[Case] = [dict(case) for case in loop["cases"]]
    names = [name for name in LAYOUTS if name in loop["layouts"]] + [AT_ONCE] * bool(corners)
    densities = {name: np.array(loop["layouts"][name]["density"]) for name in names if name != AT_ONCE}
    stated = {name: float(loop["layouts"][name]["worst"]) for name in densities}
    met: dict[str, float] = {}
    for name in names:
        if name == AT_ONCE:
            densities[name], stated[name] = corners_at_once(
                model, space, loop, evaluations=corners, seed=seed
            )
            tell(f"{AT_ONCE} at once: {stated[name]:.4f} {model.unit} over them")
        inside = runs.values(densities[name], box)
        cases.append(box[int(inside.argmax())])
        runs_here = budget if name == names[0] else rivals
        searched = AtLongerStep(runs) if coarse else runs
        _, case = outsider(searched, densities[name], space, budget=runs_here, seed=seed)
        worst = float(runs.values(densities[name], [case])[0])
        met[name] = max(worst, float(inside.max()))
        cases.append(case)
        tell(f"{name}: the box {inside.max():.4f}, the outsider {worst:.4f} {model.unit}, {runs.made} runs")
    return [_judged(name, densities[name], runs, box, cases, stated[name], met[name]) for name in names]


def _judged(
    name: str, density: Array, runs: Runs, box: list[Case], cases: list[Case], stated: float, met: float
) -> Tried:
    stays = [_retained(o) for o in runs.of(density)(box, purpose="study")]
    there = [_retained(o) for o in runs.of(density)(cases, purpose="study")]
    return Tried(
        name=name, stated=stated, met=met,
        over_all=float(runs.values(density, cases).max()), of_the_box=counted_share(sum(stays), len(stays)),
        worst_of_the_box=float(runs.values(density, box).max()), cases=(sum(there), len(there)),
        runs=runs.made,
    )  # fmt: skip


def _retained(outcome: Any) -> bool:
    """Whether a run says that he stayed; one that failed says nothing and counts as one that did not."""
    return bool(outcome.outputs.get("ejected", 1.0) == 0.0)


def lines(found: list[Tried], unit: str) -> list[str]:
    """The table."""
    return [
        f"{t.name:13} stated {t.stated:.4f}  outsider {t.met:.4f} ({100 * t.beyond:.1f} % beyond)  "
        f"over all cases {t.over_all:.4f} {unit}  box: worst {t.worst_of_the_box:.4f}, "
        f"retained {t.of_the_box.hits} of {t.of_the_box.draws} ("
        f"{100 * t.of_the_box.low:.1f} to {100 * t.of_the_box.high:.1f} % with 95 %)  "
        f"cases found: retained {t.cases[0]} of {t.cases[1]}"
        for t in found
    ]


def main() -> None:
    """Print the table."""
    ask = ArgumentParser(
        prog="python -m studies.gunner_outsider", description=(__doc__ or "").splitlines()[0]
    )
    ask.add_argument("study", type=Path)
    ask.add_argument(
        "budget", nargs="?", type=runs_of_an_outsider, default=1000, help="runs against the robust layout"
    )
    ask.add_argument("seed", nargs="?", type=int, default=4711)
    ask.add_argument("--rivals", type=runs_of_an_outsider, help="runs against each other layout (a quarter)")
    ask.add_argument("--box", type=int, help="independent cases of the box (a quarter)")
    ask.add_argument("--corners", type=int, default=0, help="evaluations for 50 corners at once (none)")
    ask.add_argument("--coarse", action="store_true", help="search at the longer step, run the worst truly")
    given = ask.parse_args()
    model, space, loop = loop_of(given.study)
    found = tried(
        model, space, loop, budget=given.budget, seed=given.seed, rivals=given.rivals, of_the_box=given.box,
        corners=given.corners, coarse=given.coarse, tell=lambda text: print(text, flush=True),
    )  # fmt: skip
    print("\n".join(lines(found, model.unit)), flush=True)


if __name__ == "__main__":
    main()

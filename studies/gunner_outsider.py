"""The layouts of a finished loop of the gunner's restraints, tried by an outsider; who stays in the hatch.

    python -m studies.gunner_outsider study.toml [runs against the robust layout] [seed]

The study's campaign stands beside it. The robust layout, the one of the nominal case and the uniform one are
run in the same independent cases of the box, from which the share of cases follows in which the gunner is
retained; then the outsider of `studies.loop_claims` searches for a worse case for each, with a quarter of the
runs for the two rivals. All are judged over all cases that the loop or the outsider found for any of them.
Retained: `ejected` is 0, he never rose above the hatch. No surrogate, seed or case of the loop is used.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.loop_claims import outsider
from studies.loop_rivals import Runs
from workbench.errors import StudyError
from workbench.robust_layout.model import LayoutModel, load_layout_model
from workbench.search.evidence.attack.share import Share, counted_share
from workbench.space.box import Space
from workbench.study.loading import load_study
from workbench.system.atomic import read_json

__all__ = ["LAYOUTS", "Tried", "lines", "loop_of", "main", "tried"]

Array = np.ndarray[Any, Any]
Case = Mapping[str, Any]

LAYOUTS = ("robust", "nominal only", "uniform")


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


def tried(
    model: LayoutModel, space: Space, loop: Mapping[str, Any], *, budget: int, seed: int,
    tell: Callable[[str], None] = lambda text: None,
) -> list[Tried]:  # fmt: skip
    """The layouts of a loop, each in independent cases and against the outsider."""
    runs, rng = Runs(model), np.random.default_rng([seed, 5])
    table = space.quantile(rng.random((budget // 4, space.dimension)))
    box: list[Case] = [space.canonical(dict(zip(space.names, row, strict=True))) for row in table.tolist()]
    cases: list[Case] = [dict(case) for case in loop["cases"]]
    names = [name for name in LAYOUTS if name in loop["layouts"]]
    densities = {name: np.array(loop["layouts"][name]["density"]) for name in names}
    met: dict[str, float] = {}
    for name in names:
        inside = runs.values(densities[name], box)
        cases.append(box[int(inside.argmax())])
        share = 1.0 if name == names[0] else 0.25
        worst, case = outsider(runs, densities[name], space, budget=int(share * budget), seed=seed)
        met[name] = max(worst, float(inside.max()))
        cases.append(case)
        tell(f"{name}: the box {inside.max():.4f}, the outsider {worst:.4f} {model.unit}, {runs.made} runs")
    return [_judged(name, densities[name], runs, box, cases, loop, met[name]) for name in names]


def _judged(
    name: str, density: Array, runs: Runs, box: list[Case], cases: list[Case], loop: Mapping[str, Any],
    met: float,
) -> Tried:  # fmt: skip
    stays = [_retained(o) for o in runs.of(density)(box, purpose="study")]
    there = [_retained(o) for o in runs.of(density)(cases, purpose="study")]
    return Tried(
        name=name, stated=float(loop["layouts"][name]["worst"]), met=met,
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
    file, *rest = sys.argv[1:]
    budget, seed = (int(rest[0]) if rest else 1000), (int(rest[1]) if len(rest) > 1 else 4711)
    model, space, loop = loop_of(Path(file))
    found = tried(model, space, loop, budget=budget, seed=seed, tell=lambda text: print(text, flush=True))
    print("\n".join(lines(found, model.unit)), flush=True)


if __name__ == "__main__":
    main()

"""At most so many whole belts in severe braking, beside belts in fractions, both under attack.

    python -m studies.gunner_whole_belts [numbers, as 4,8,12] [--rounds N] [--attack N] [--outsider N]

The gunner of the shipped demonstration with its uncertainty. For every number of belts two layouts are made:

    in fractions   the same sum of densities, each between 0 and 1
    whole          `whole_members`: belts that are there or not, mirror images together, anchors counted

for the cases known, then both are attacked by the adversary of the robust loop; what breaks one of them joins
the cases, and both are made anew while there are rounds. At the end an outsider with a sampler of his own
(`studies.loop_claims`) tries every layout, and all are judged over all cases that anybody found for any of
them. The search takes steps of 2 ms; what is told are true runs of the demonstration's step.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.gunner.cabin.facing import HATCH
from studies.gunner.restraints.ground_structure import sites
from studies.gunner.restraints.model import GunnerRestraint, restraint
from studies.loop_claims import outsider
from studies.loop_rivals import Runs
from workbench.engine import optimise_layout
from workbench.engine.layout.formulation.groups import mirrored
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.whole.spending import Spending
from workbench.engine.layout.whole_members import whole_members
from workbench.robust_layout.judged import JudgedLayouts
from workbench.robust_layout.oracle import LayoutOracle
from workbench.robust_layout.scenarios import stratified_cases
from workbench.space.box import Space
from workbench.study.loading import load_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COUNTS", "Counted", "Effort", "count_belts", "curve", "lines", "main", "searched_problem"]

Array = np.ndarray[Any, Any]
Case = Mapping[str, Any]

COUNTS = (4, 8, 12, 20)
SEARCHED = 2e-3  # s: step of the searches
ALLOWED = 0.02  # by which an attack may exceed the known worst
NEAR = 0.6  # of the worst: cases below it are left out of a search
JOINING = 4  # cases that join after an attack at most


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """What each number of belts may cost.

    scenarios: of the stratified set that it begins with.  fractions, whole: evaluations of each search.
    rounds: searches at most.  attack, outsider: true runs against each layout.  seed: of all of these.
    """

    scenarios: int = 6
    fractions: int = 16
    whole: int = 50
    rounds: int = 1
    attack: int = 60
    outsider: int = 100
    seed: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Counted:
    """What so many belts give: worst deviations, m, over all cases found for any layout.

    stated: the worst of both layouts before the outsider came.  beyond: by which share he went beyond it.
    whole_density (180,): of zeros and ones.  anchors: points of the vehicle that these belts use.
    """

    count: int
    uniform: float
    fractions: float
    whole: float
    stated: tuple[float, float]
    beyond: tuple[float, float]
    whole_density: Array
    anchors: int
    status: str

    @property
    def price(self) -> float:
        """What whole belts cost beside fractions, relative to these."""
        return self.whole / self.fractions - 1.0


def searched_problem(model: GunnerRestraint, cases: Sequence[Case]) -> LayoutProblem:
    """The problem of some cases in the steps of the search."""
    return replace(model, steps=round(model.t_end / SEARCHED)).problem(cases)


def count_belts(
    counts: Sequence[int] = COUNTS, *, effort: Effort | None = None, model: GunnerRestraint | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> list[Counted]:  # fmt: skip
    """Layouts of so many whole belts and of fractions, attacked.

    model: without airbags; None for that of the demonstration. tell: called with what is being done.
    """
    study = load_study(str(files("studies.gunner.restraints") / "restraint_demo.toml"))
    effort, model = effort or Effort(), model or restraint(airbags=0.0)
    runs = Runs(model)
    assert study.robust_layout is not None
    nominal = study.space.canonical(study.robust_layout["nominal"])
    judged = JudgedLayouts(
        evaluator=runs.of, response=model.response,
        cases=[nominal, *stratified_cases(study.space, effort.scenarios, seed=effort.seed)],
    )  # fmt: skip
    made = [_made(count, model, study.space, judged, effort, tell) for count in counts]
    stated = [tuple(judged.worst(name) for name in one.names) for one in made]
    beyond = []
    for one, (fractions, whole) in zip(made, stated, strict=True):
        met = []
        for name in one.names:
            tell(f"{name}: the outsider")
            worst, case = outsider(
                runs, judged.layouts[name], study.space, budget=effort.outsider, seed=effort.seed
            )
            judged.join([case])
            met.append(worst)
        beyond.append((max(0.0, met[0] / fractions - 1.0), max(0.0, met[1] / whole - 1.0)))
    return [
        Counted(
            count=one.count, uniform=judged.worst(one.uniform), fractions=judged.worst(one.names[0]),
            whole=judged.worst(one.names[1]), stated=(stated[k][0], stated[k][1]), beyond=beyond[k],
            whole_density=judged.layouts[one.names[1]], anchors=one.anchors, status=one.status,
        )
        for k, one in enumerate(made)
    ]  # fmt: skip


@dataclass(slots=True, kw_only=True)
class _Made:
    """The layouts of one number of belts, by their names among all that are judged."""

    count: int
    uniform: str
    names: tuple[str, str] = ("", "")
    anchors: int = -1
    status: str = ""
    known: dict[str, tuple[int, str]] = field(default_factory=dict)  # anchors and status of whole layouts


def _made(
    count: int, model: GunnerRestraint, space: Space, judged: JudgedLayouts, effort: Effort,
    tell: Callable[[str], None],
) -> _Made:  # fmt: skip
    """Both layouts of a number of belts: searched, attacked, searched again for what broke them."""
    model = replace(model, limits={"belt": float(count)})
    one = _Made(count=count, uniform=f"{count} spread evenly")
    judged.layouts[one.uniform] = np.full(model.members, count / model.members)
    fractions, whole = [one.uniform], [one.uniform]
    with TemporaryDirectory() as folder:
        oracle = LayoutOracle(
            model=model, space=space, evaluator=judged.evaluator, folder=Path(folder), identity="study",
            budget=effort.attack, corners=0, seed=effort.seed, going_on=0,
        )  # fmt: skip
        for turn in range(1, effort.rounds + 1):
            active = _active(judged, (fractions[-1], whole[-1]))
            tell(f"{count} belts, round {turn}: {len(active)} of {len(judged.cases)} cases")
            problem = searched_problem(model, active)
            start = judged.layouts[judged.best(fractions)]
            relaxed = optimise_layout(
                replace(problem, start=start), max_evaluations=effort.fractions, multi_start=turn == 1,
                compare=False, probes=0,
            )  # fmt: skip
            fractions.append(f"{count} in fractions, round {turn}")
            judged.layouts[fractions[-1]] = relaxed.density
            found = _whole(problem, count, effort)
            whole.append(f"{count} whole, round {turn}")
            judged.layouts[whole[-1]] = found.density
            one.known[whole[-1]] = found.anchors, found.status.name
            one.names = judged.best(fractions[1:]), judged.best(whole[1:])
            if not _attacked(one.names, judged, oracle, turn=turn, tell=tell):
                break
    one.names = judged.best(fractions[1:]), judged.best(whole[1:])
    one.anchors, one.status = one.known[one.names[1]]
    return one


def _whole(problem: LayoutProblem, count: int, effort: Effort) -> Any:
    geometry = problem.geometry
    assert geometry is not None
    vehicle = {int(body) for body in np.asarray(geometry.body_b)}
    return whole_members(
        problem, count, evaluations=effort.whole, seed=effort.seed,
        groups=mirrored(geometry, axis=1, at=float(HATCH[1])),
        spending=Spending(anchor=1.0, bodies=sorted(vehicle)),
    )  # fmt: skip


def _active(judged: JudgedLayouts, names: Sequence[str]) -> list[Case]:
    """Cases near the worst of one of these layouts."""
    near = set()
    for name in names:
        values = judged.values(name)
        worst = judged.worst(name)
        near |= {k for k, v in enumerate(values) if v is not None and v >= NEAR * worst}
    return [judged.cases[k] for k in sorted(near)]


def _attacked(
    names: Sequence[str], judged: JudgedLayouts, oracle: LayoutOracle, *, turn: int,
    tell: Callable[[str], None],
) -> bool:  # fmt: skip
    """Whether the adversary broke one of these layouts; what broke them joins the cases."""
    broken = False
    for name in names:
        bound = judged.worst(name)
        limit = (1.0 + ALLOWED) * bound
        found = oracle.attack(judged.layouts[name], judged.cases, limit=limit, turn=turn)
        tell(f"attack {turn} on {name}: {bound:.4f} m, attacked {found.value:.4f} m")
        if found.value > limit:
            broken = True
            worse = [dict(other["case"]) for other in found.others if other["value"] > limit]
            judged.join([found.case, *worse[: JOINING - 1]])
    return broken


def lines(found: Counted) -> list[str]:
    """A row of the table, and which belts they are."""
    belts = [site for site, a in zip(sites(), found.whole_density, strict=False) if a > 0.5]
    which = ", ".join(f"{s.side} {s.segment.split()[0]} layer {s.layer} (no. {s.number})" for s in belts)
    return [
        f"{found.count:3d} belts  spread evenly {found.uniform:.4f}  in fractions {found.fractions:.4f}  "
        f"whole {found.whole:.4f} m  price {100 * found.price:.1f} %  "
        f"{len(belts)} on, {found.anchors} anchors  outsider beyond "
        f"{100 * found.beyond[0]:.1f}, {100 * found.beyond[1]:.1f} %  {found.status}",
        f"    {which}",
    ]


def curve(found: Sequence[Counted]) -> "Figure":
    """Worst deviation by number of belts."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    ax = figure.subplots()
    counts = [one.count for one in found]
    ax.plot(counts, [one.uniform for one in found], "0.6", marker="^", label="spread evenly")
    ax.plot(counts, [one.fractions for one in found], "C0", marker="o", label="in fractions")
    ax.plot(counts, [one.whole for one in found], "C1", marker="s", label="whole, in mirror images")
    ax.set(xlabel="belts, at most", ylabel="worst deviation after attack, m", xticks=counts)
    ax.set_ylim(bottom=0.0)
    ax.legend(fontsize=8)
    return figure


def main() -> None:
    """Print the table and save the curve."""
    default = Effort()
    ask = ArgumentParser(
        prog="python -m studies.gunner_whole_belts", description=(__doc__ or "").splitlines()[0]
    )
    ask.add_argument("counts", nargs="?", default=COUNTS, type=_counts, help="numbers of belts, as 4,8,12")
    ask.add_argument("--rounds", type=int, default=default.rounds, help="searches at most, each attacked")
    ask.add_argument("--attack", type=int, default=default.attack, help="runs of the adversary a layout")
    ask.add_argument("--outsider", type=int, default=default.outsider, help="runs of the outsider a layout")
    ask.add_argument("--seed", type=int, default=default.seed, help="of cases, attacks and outsider")
    ask.add_argument("--folder", type=Path, default=Path(), help="where the curve is drawn")
    given = ask.parse_args()
    effort = replace(
        default, rounds=given.rounds, attack=given.attack, outsider=given.outsider, seed=given.seed
    )
    found = count_belts(given.counts, effort=effort, tell=lambda text: print(text, flush=True))
    for one in found:
        print("\n".join(lines(one)), flush=True)
    curve(found).savefig(given.folder / "gunner_whole_belts.png", dpi=100)


def _counts(text: str) -> tuple[int, ...]:
    return tuple(int(number) for number in text.split(","))


if __name__ == "__main__":
    main()

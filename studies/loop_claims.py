"""Do the claims of robust loops hold? Loops of the demo's size in other boxes, each attacked by an outsider.

Every seed draws a box (decelerations, masses, seats and grips up to a fifth outside of the demo's and as
little as half as wide), the numbers of belts and airbags, and a loop with the demo's budgets on the occupant.
Its layout is then tried by an outsider with a sampler of its own: a third of the runs inside, a third near
corners and with single changes of bad ones, a third climbs by random steps.

    beaten      by how much the outsider goes beyond the stated worst, in per cent
    may exceed  what an open loop said about that; a closed one claims its tolerance, 2 %

With `corners` the plainest rival stands beside uniform and nominal only: 50 random corners optimised all at
once, with as many runs as the loop has made.

`python -m studies.loop_claims 300 8 3000` prints eight loops, with 3 000 runs of the outsider on each layout;
`python -m studies.loop_claims 9602 3 3000 250 corners` three with steps of 8 ms and the 50 corners;
with `--rounds 2` a loop is cut short, and what is said of one that did not close is counted;
with `--attack 200` its attacks are as short as that, which is too short to close it;
with `--further 100` what is said to be left to gain is held against long searches (`studies.left_to_gain`).
"""

import sys
import time
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from studies.left_to_gain import Left, left_to_gain
from studies.loop_rivals import CORNERS, Runs, counting, nominal, sample_approach
from studies.occupant_braking import restraint
from workbench.robust_layout.loop import find_robust_layout
from workbench.robust_layout.record import LoopSettings, RobustLayout
from workbench.space.box import Space
from workbench.study.loading import load_study

__all__ = ["Claim", "attacked", "drawn_space", "outsider", "runs_of_an_outsider", "settings_of_the_demo"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

ALLOWED = 0.02  # what a closed loop may be beaten by
OUTSIDE = 0.2  # of a range may be added at either end
NARROWEST = 0.5  # of a range
MOVED = ("deceleration", "mass", "seat_cap", "seat_rate", "grip")  # ranges that may leave the demo's
STEPS = 500  # of the two seconds: half of the demo's, whose peaks they meet within 6e-4


def demo() -> Any:
    """The demo's study."""
    return load_study(str(files("studies") / "occupant_demo.toml"))


def settings_of_the_demo(seed: int) -> LoopSettings:
    """The loop's settings in the demo with another seed."""
    table = demo().robust_layout
    names = ("scenarios", "evaluations", "budget", "corners", "rounds", "tolerance")
    return LoopSettings(**{name: table[name] for name in names}, seed=seed)


def drawn_space(rng: np.random.Generator) -> Space:
    """The demo's parameters in other ranges."""
    drawn = []
    for p in demo().space.parameters:
        if p.lower is None or p.upper is None:
            drawn.append(p)
            continue
        reach = OUTSIDE * (p.upper - p.lower) if p.name in MOVED else 0.0
        low, high = p.lower - reach, p.upper + reach
        width = (p.upper - p.lower) * rng.uniform(NARROWEST, 1.0)
        start = low + rng.random() * (high - low - width)
        if p.step is not None:
            start = p.lower + p.step * round((start - p.lower) / p.step)
            width = p.step * max(1, round(width / p.step))
        drawn.append(replace(p, lower=start, upper=start + width))
    return Space(tuple(drawn))


@dataclass(slots=True)
class _Cases:
    """Cases as places in the unit cube, words as whole numbers, and back."""

    space: Space

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        """A case inside."""
        return {p.name: self._value(p, rng.random()) for p in self.space.parameters}

    def near_corner(self, rng: np.random.Generator) -> dict[str, Any]:
        """A corner with two coordinates inside."""
        inside = rng.choice(len(self.space.parameters), 2, replace=False)
        return {
            p.name: self._value(p, rng.random() if k in inside else float(rng.integers(2)), rng)
            for k, p in enumerate(self.space.parameters)
        }

    def change(self, case: Case, rng: np.random.Generator) -> dict[str, Any]:
        """One parameter elsewhere: at an end, or at another word."""
        p = self.space.parameters[rng.integers(len(self.space.parameters))]
        return {**case, p.name: self._value(p, float(rng.integers(2)), rng)}

    def step(self, case: Case, rng: np.random.Generator, size: float) -> dict[str, Any]:
        """Three numbers moved by a normal step of `size` of their ranges."""
        moved = dict(case)
        for k in rng.choice(len(self.space.parameters), min(3, len(self.space.parameters)), replace=False):
            p = self.space.parameters[k]
            if p.lower is None or p.upper is None:
                continue
            width = p.upper - p.lower
            moved[p.name] = self._value(p, (case[p.name] - p.lower) / width + size * rng.standard_normal())
        return moved

    def _value(self, p: Any, share: float, rng: np.random.Generator | None = None) -> Any:
        share = min(max(share, 0.0), 1.0)
        if p.lower is None or p.upper is None:
            place = int(share * len(p.levels)) if rng is None else int(rng.integers(len(p.levels)))
            return p.levels[min(place, len(p.levels) - 1)]
        width = p.upper - p.lower
        return p.lower + (p.step * round(share * width / p.step) if p.step else share * width)


class Valued(Protocol):
    """Runs of layouts: true ones (`Runs`), or others to search by."""

    def values(self, density: Array, rows: Sequence[Case]) -> Array:
        """(cases,) of the response of a layout, minus infinity where it fails."""


def outsider(runs: Valued, density: Array, space: Space, *, budget: int, seed: int) -> tuple[float, Case]:
    """The worst value that a sampler of its own meets on a layout, and its case."""
    rng, at = np.random.default_rng([seed, 9091]), _Cases(space)
    third = budget // 3
    cases = [space.canonical(at.draw(rng)) for _ in range(third)]
    cases += [space.canonical(at.near_corner(rng)) for _ in range(third // 2)]
    values = runs.values(density, cases)
    left = third - third // 2
    while left > 0:
        best = np.argsort(-values)[:12]
        fresh = [space.canonical(at.change(cases[int(rng.choice(best))], rng)) for _ in range(min(60, left))]
        left -= len(fresh)
        cases, values = cases + fresh, np.append(values, runs.values(density, fresh))
    tops = [(cases[k], values[k], 0.25) for k in np.argsort(-values)[:8]]
    for _ in range(max(1, (budget - 2 * third) // len(tops))):
        tried = [space.canonical(at.step(case, rng, size)) for case, _, size in tops]
        found = runs.values(density, tried)
        tops = [
            (new, v, size) if v > top else (case, top, max(0.9 * size, 0.01))
            for (case, top, size), new, v in zip(tops, tried, found, strict=True)
        ]
        cases, values = cases + tried, np.append(values, found)
    worst = int(values.argmax())
    return float(values[worst]), cases[worst]


def runs_of_an_outsider(text: str) -> int:
    """A number of runs as a command line gives it: one at least inside, near corners and in climbs."""
    if not text.isdecimal() or int(text) < 3:
        raise ArgumentTypeError(f"an outsider takes at least 3 runs, got {text}")
    return int(text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """What a loop said, and what the outsider found.    beaten: share beyond the stated worst.

    left: what more evaluations gained, None where none were spent.
    """

    closed: bool
    stated: float
    may_exceed: float
    beaten: float
    arrived: int
    attack_runs: int
    others: Mapping[str, float]  # uniform, nominal only, perhaps 50 corners: over all cases found by anybody
    robust: float
    reasons: tuple[str, ...]
    left: Left | None = None

    @property
    def holds(self) -> bool:
        """Whether the outsider stayed within what was claimed."""
        return self.beaten <= (ALLOWED if self.closed else self.may_exceed)


def attacked(
    found: RobustLayout, runs: Runs, space: Space, *, budget: int, seed: int,
    rivals: Mapping[str, Array] | None = None,
) -> Claim:  # fmt: skip
    """The claim of a loop, once an outsider has tried its layout, those it is compared with, and `rivals`."""
    density, stated = found.layouts[found.robust], found.worst[found.robust]
    worst, case = outsider(runs, density, space, budget=budget, seed=seed)
    cases = [*found.cases, case]
    others = {**{name: found.layouts[name] for name in ("uniform", "nominal only")}, **(rivals or {})}
    cases += [outsider(runs, other, space, budget=budget // 4, seed=seed)[1] for other in others.values()]
    attack = stated.attack or {}
    return Claim(
        closed=found.closed, stated=stated.value, may_exceed=found.may_exceed,
        beaten=max(0.0, worst / stated.value - 1.0), arrived=attack.get("arrived", 0),
        attack_runs=attack.get("runs", 0),
        others={name: float(runs.values(other, cases).max()) for name, other in others.items()},
        robust=float(runs.values(density, cases).max()), reasons=tuple(found.reasons),
    )  # fmt: skip


def claim_of(
    seed: int, *, budget: int, steps: int = STEPS, rounds: int | None = None, attack: int | None = None,
    corners: bool = False, further: int | None = None, tell: Any = lambda text: None,
) -> tuple[Claim, float]:  # fmt: skip
    """What the loop of one box claims, tried with `budget` runs, and the processor seconds of the loop.

    rounds: at most, None for the demo's.    attack: runs of every attack, None for the demo's.
    corners: also make the layout for 50 random corners, with as many runs.
    further: evaluations of searches over all cases found, against what is said to be left to gain.
    """
    settings = settings_of_the_demo(seed)
    settings = settings if rounds is None else replace(settings, rounds=rounds)
    settings = settings if attack is None else replace(settings, budget=attack)
    rng = np.random.default_rng([seed, 41])
    space = drawn_space(rng)
    model = restraint(belts=float(rng.integers(4, 10)), airbags=float(rng.integers(4, 10)), steps=steps)
    runs, (counted, simulated) = Runs(model), counting(model)
    with TemporaryDirectory() as folder:
        begun = time.process_time()
        found = find_robust_layout(
            counted if corners else model, space, evaluator=runs.of, folder=Path(folder),
            start=[nominal(space)], settings=settings, identity="study", tell=tell,
            coarse=runs.coarse,
        )  # fmt: skip
        spent = time.process_time() - begun
    rivals = {}
    if corners:
        evaluations = (runs.made + simulated[0]) // (CORNERS + 1)
        rivals["50 corners"] = sample_approach(
            model, space, start=nominal(space), evaluations=evaluations, seed=seed
        )
    claim = attacked(found, runs, space, budget=budget, seed=seed, rivals=rivals)
    if further is not None:
        left = left_to_gain(model, found, Runs(model), evaluations=further, seed=seed)
        claim = replace(claim, left=left)
    return claim, spent


def counted(made: list[Claim]) -> str:
    """Of how many loops the claims hold, and how much better than its rivals the robust layout is."""
    closed = [c for c in made if c.closed]
    better = {name: [c.others[name] / c.robust - 1.0 for c in made] for name in made[0].others}
    lines = [
        f"closed {len(closed)} of {len(made)}, "
        f"of these beaten by more than {100 * ALLOWED:.0f} %: {sum(not c.holds for c in closed)}",
        f"what open loops say of how far they may be off holds in "
        f"{sum(c.holds for c in made if not c.closed)} of {len(made) - len(closed)}",
    ]
    lines += [
        f"{name} is worse by {100 * np.median(b):.0f} % in the median, better in {sum(x < 0 for x in b)}"
        for name, b in better.items()
    ]
    lefts = [(c.left, not c.reasons) for c in made if c.left is not None]
    if lefts:
        green = [left.gained for left, is_green in lefts if is_green]
        lines.append(
            f"no more was gained than is said to be left in {sum(left.holds for left, _ in lefts)} of "
            f"{len(lefts)}; {len(green)} are green, of which {sum(gain > ALLOWED for gain in green)} gained "
            f"more than {100 * ALLOWED:.0f} %"
        )
    return "\n".join(lines)


def _second_line(claim: Claim) -> str:
    """Why a loop is not green, after what was said to be left and what was gained."""
    if claim.left is None:
        return "; ".join(claim.reasons)
    said = "unknown" if claim.left.said is None else f"{100 * claim.left.said:.2f} %"
    return "; ".join([f"left {said}, gained {100 * claim.left.gained:.2f} %", *claim.reasons])


def main(
    first: int, loops: int, budget: int, steps: int = STEPS, rounds: int | None = None, *,
    attack: int | None = None, corners: bool = False, further: int | None = None,
) -> None:  # fmt: skip
    """Print two lines for every loop, and what they count up to."""
    beside = "  50 corners" if corners else ""
    print(
        "seed  closed  arrived   runs  stated  may exceed  beaten  holds  robust  uniform  nominal"
        f"{beside}  CPU s"
    )
    made = []
    for seed in range(first, first + loops):
        claim, spent = claim_of(
            seed, budget=budget, steps=steps, rounds=rounds, attack=attack, corners=corners, further=further
        )
        made.append(claim)
        print(
            f"{seed:4d}  {'yes' if claim.closed else 'no':6s}  {claim.arrived:7d}  "
            f"{claim.attack_runs:5d}  {claim.stated:6.4f}  {100 * claim.may_exceed:8.2f} %  "
            f"{100 * claim.beaten:4.1f} %  {'yes' if claim.holds else 'NO':5s}  {claim.robust:6.4f}  "
            f"{claim.others['uniform']:7.4f}  {claim.others['nominal only']:7.4f}  "
            + "".join(f"{claim.others[name]:10.4f}  " for name in list(claim.others)[2:])
            + f"{spent:5.0f}",
            flush=True,
        )
        print("      " + _second_line(claim), flush=True)
    print(counted(made))


def arguments(words: Sequence[str]) -> Namespace:
    """The command line; what does not fit ends with a sentence and code 2."""
    parser = ArgumentParser(
        prog="python -m studies.loop_claims", description="Do the claims of robust loops hold?"
    )
    number: dict[str, Any] = {"nargs": "?", "type": int}
    parser.add_argument("first", default=300, help="seed of the first loop", **number)
    parser.add_argument("loops", default=8, help="how many", **number)
    parser.add_argument("budget", nargs="?", type=runs_of_an_outsider, default=3000, help="his runs")
    parser.add_argument("steps", default=STEPS, help="of a run of two seconds", **number)
    parser.add_argument("beside", nargs="?", choices=["corners"], help="the layout of 50 corners, too")
    parser.add_argument("--rounds", type=int, help="of every loop, fewer than the demo's", default=None)
    parser.add_argument(
        "--attack", type=int, help="runs of every attack, other than the demo's", default=None
    )
    parser.add_argument("--further", type=int, help="evaluations of searches over all cases", default=None)
    asked = parser.parse_args(words)
    for name in ("loops", "steps", "rounds", "attack", "further"):
        value = getattr(asked, name)
        if value is not None and value < 1:
            parser.error(f"{name} needs to be 1 or more, got {value}")
    return asked


if __name__ == "__main__":
    said = arguments(sys.argv[1:])
    main(
        said.first, said.loops, said.budget, said.steps, said.rounds,
        attack=said.attack, corners=said.beside == "corners", further=said.further,
    )  # fmt: skip

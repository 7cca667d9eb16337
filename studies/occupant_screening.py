"""Do 64 runs tell which of the fourteen parameters matter? Over seeds, for two designs, bare and restrained.

Bare, the response jumps where the occupant leaves, so parameters are selected by its ranks; restrained by a
uniform layout it is smooth, and is taken as it is. Two factors, of joints that turn out of the plane, are
inert by construction: selecting one is a false alarm.

    python -m studies.occupant_screening 20
"""

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.occupant_braking import braking_occupant, restraint
from workbench.sampling.plan import DesignOptions, make_design
from workbench.screening.kriging import screen
from workbench.study.loading import load_study
from workbench.study.shipped import copy_study

__all__ = ["DESIGNS", "INERT", "Tally", "tallies"]

DESIGNS = ("ihs", "optimised_lhs")
INERT = ("k_shoulder_tz", "k_hip_tz")
RUNS = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """How often each parameter was selected, and in how many seeds both inert ones were left out."""

    design: str
    restrained: bool
    seeds: int
    selected: Counter[str]
    clean: int


def tallies(seeds: int, *, folder: str) -> Iterator[Tally]:
    """One tally per design, bare and restrained; `folder` takes a copy of the study file."""

    study = load_study(copy_study(Path(folder)))
    response = study.response("peak_deviation")
    model = restraint()
    uniform = np.full(model.members, sum(model.limits.values()) / model.members)
    for design in DESIGNS:
        for restrained in (False, True):
            selected: Counter[str] = Counter()
            transform = "none" if restrained else "ranks"
            clean = 0
            for seed in range(1, seeds + 1):
                made = make_design(study.space, design, RUNS, seed=seed, options=DesignOptions())
                rows = [
                    {**row, **(model.responses(uniform, row) if restrained else braking_occupant(**row))}
                    for row in made.rows()
                ]
                found = screen(
                    rows, study.space, response, transform=transform, seed=seed, effects=False
                ).selected
                selected.update(found)
                clean += not set(found) & set(INERT)
            yield Tally(design=design, restrained=restrained, seeds=seeds, selected=selected, clean=clean)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        for tally in tallies(int(sys.argv[1]) if len(sys.argv) > 1 else 3, folder=folder):
            state = "uniform layout" if tally.restrained else "bare"
            print(
                f"{tally.design}, {state}: both inert left out in {tally.clean} of {tally.seeds}", flush=True
            )
            often = [f"{name} {n}" for name, n in tally.selected.most_common()]
            print("   selected: " + ", ".join(often), flush=True)

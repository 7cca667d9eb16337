"""The worst case of the source beside the worst found over everything at once, attacked.

    python -m studies.gunner.checks.preset [budget] [runs of the attack]

Section 8.3 finds its worst case one thing at a time: a grip of 371 N, then the joints of Table 8.8. Here
grip, hands, joints, seat, mass and ground vary together, in the rollover (earliest ejection; what g2 does
after an ejection is free flight) and in braking (largest deviation within 1.5 s). The adversary's runs are
beside those of the search and share nothing with it.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from workbench import Parameter, Space
from workbench.engine import simulate
from workbench.search.worst_case import WorstCase, worst_case

from ..cases import system
from ..figure_numbers import JOINTS
from ..occupant_responses import REFERENCE_HEIGHT, objectives
from ..uncertain import TIMES, case_of

__all__ = ["ANY", "ASKED", "PRESET", "Beside", "beside", "lines", "look", "main", "space"]

PRESET: Mapping[str, Any] = MappingProxyType({"grip": 371.0, "k_shoulder_tx": 2.0, "k_wrist_tx": 0.5})
STEP = 2e-3  # s
# ground, response, which side is bad
ASKED = (("rollover", "ejected_at", "min"), ("braking", "deviation", "max"))
ANY = ("none", "one", "both")


def space(ground: str, *, hands: tuple[str, ...] = ANY) -> Space:
    """Everything that is uncertain on a ground; hands: which of them may hold."""
    stiff = 2.0 if ground == "rollover" else 1.0
    own = {
        "rollover": (
            Parameter("friction", lower=1.15, upper=1.25),
            Parameter("turn", lower=640, upper=720, unit="deg"),
        ),
        "braking": (Parameter("deceleration", lower=6, upper=9, unit="m/s2"),),
    }[ground]  # fmt: skip
    return Space(
        [
            Parameter("grip", lower=350, upper=700, step=7, unit="N"),
            *([Parameter("hands", kind="categorical", levels=hands)] if len(hands) > 1 else []),
            *(Parameter(f"k_{joint}", lower=0.5, upper=2, scale="log") for joint in JOINTS),
            Parameter("seat_rate", lower=5e3 * stiff, upper=2e4 * stiff, unit="N/m"),
            Parameter("seat_cap", lower=500, upper=1000, unit="N"),
            Parameter("mass", lower=60, upper=95, unit="kg"),
            *own,
        ]
    )


def look(ground: str, row: Mapping[str, Any], *, step: float = STEP) -> dict[str, float]:
    """Ejection (s; the end of the run where it does not happen), g2 and deviation (m) of one run."""
    t_end = TIMES[ground]
    run = simulate(system(case_of(ground, row)), np.zeros(0), t_end, round(t_end / step))
    ask = objectives(run.system, t_end=t_end)
    return {
        "ejected_at": float(ask["ejected_at"].value(run)),
        "g2": float(ask["highest"].value(run)) - REFERENCE_HEIGHT,
        "deviation": float(np.sqrt(ask["g1"].value(run))),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """A response at the nominal case, at the preset of the source, and at the worst that was found."""

    ground: str
    response: str
    nominal: float
    preset: float
    worst: float
    found: WorstCase

    @property
    def covered(self) -> float:
        """How much of the way from the nominal case to the worst the preset goes."""
        return (self.preset - self.nominal) / (self.worst - self.nominal)


def beside(
    ground: str, response: str, sense: str, *, budget: int = 60, attack: int = 100, seed: int = 1,
    hands: tuple[str, ...] = ANY,
) -> Beside:  # fmt: skip
    """One response at the nominal case, at the preset, and searched."""

    def model(**row: Any) -> dict[str, float]:
        return look(ground, row)

    uncertain = space(ground, hands=hands)
    found = worst_case(
        model, uncertain, response=response, sense=sense, budget=budget, seed=seed, attack=attack
    )
    return Beside(
        ground=ground, response=response, nominal=look(ground, {})[response],
        preset=look(ground, PRESET)[response], worst=found.value, found=found,
    )  # fmt: skip


def main() -> None:
    """Print all three, with any hands and with both."""
    budget = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    attack = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    for ground, response, sense in ASKED:
        for hands in (ANY, ("both",)):
            one = beside(ground, response, sense, budget=budget, attack=attack, hands=hands)
            print("\n".join(lines(one, hands)), flush=True)


def lines(one: Beside, hands: tuple[str, ...]) -> list[str]:
    """The figures, where the worst lies, and what the adversary says."""
    held = "any" if len(hands) > 1 else hands[0]
    place = {k: v if isinstance(v, str) else round(v, 3) for k, v in one.found.parameters.items()}
    return [
        f"{one.ground}, {one.response}, hands {held}: nominal {one.nominal:.4f}, 371 N and Table 8.8 "
        f"{one.preset:.4f}, worst {one.worst:.4f}; the preset goes {100 * one.covered:.0f} % of the way",
        f"    at {place}",
        f"    {one.found.grade_sentence}",
    ]


if __name__ == "__main__":
    main()

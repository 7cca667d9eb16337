"""The gunner as a model of a study: a row of uncertain parameters in, responses out.

    braking_gunner(grip=371.0, hands="one", k_elbow=0.5)     one function for each proving ground

A row names any of `NOMINAL`; what it does not name has its nominal value. `fires_late` (s) is the timing
error of retractors, see `restraints.model`: it does nothing to a gunner without any.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from workbench.engine import simulate

from .cases import Case, system
from .figure_numbers import JOINTS
from .occupant_responses import responses_of
from .proving_grounds import ProvingGround, braking, rollover, step_steer

__all__ = [
    "NOMINAL", "STEP", "braking_gunner", "case_of", "proving_ground", "responses", "rollover_gunner",
    "step_steer_gunner",
]  # fmt: skip

STEP = 1e-3  # s
STEPS: Mapping[str, float] = {"L0": STEP, "L1": 0.5e-3}  # s, by level
ROLLING: Mapping[str, float] = {"seat_rate": 20_000.0, "seat_damping": 1000.0}
NOMINAL: Mapping[str, Any] = MappingProxyType(
    {
        "grip": 500.0, "hands": "both", **{f"k_{joint}": 1.0 for joint in JOINTS}, "seat_rate": None,
        "seat_damping": None, "seat_cap": None, "mass": None, "posture": "seated", "facing": 0.0,
        "level": "L0", "start": "balanced", "friction": None, "deceleration": 7.0, "turn": None,
        "fires_late": 0.0,
    }
)  # fmt: skip
TIMES = {"braking": 1.5, "step steer": 1.0, "rollover": 3.0}  # s


def proving_ground(name: str, row: Mapping[str, Any]) -> ProvingGround:
    """ "braking", "step steer" or "rollover" with the row's friction, deceleration and turn (deg)."""
    given = {key: row[key] for key in ("friction", "turn") if row.get(key) is not None}
    match name:
        case "braking":
            given.pop("turn", None)
            return braking(deceleration=row.get("deceleration", NOMINAL["deceleration"]), **given)
        case "step steer":
            return step_steer(**given)
        case "rollover":
            return rollover(**given)
    raise ValueError(f"manoeuvre needs one of {', '.join(TIMES)}, got '{name}'")


def case_of(name: str, row: Mapping[str, Any]) -> Case:
    """The case of a row on a proving ground; in the rollover the seat is twice as stiff unless the row says.

    Raises ValueError for names that are not in `NOMINAL`.
    """
    unknown = sorted(set(row) - set(NOMINAL))
    if unknown:
        raise ValueError(f"a row takes {', '.join(NOMINAL)}, got {', '.join(unknown)}")
    full = {**NOMINAL, **(ROLLING if name == "rollover" else {}), **row}
    own = (
        "grip",
        "hands",
        "seat_rate",
        "seat_damping",
        "seat_cap",
        "mass",
        "posture",
        "facing",
        "level",
        "start",
    )
    return Case(
        on=proving_ground(name, row), factors={joint: full[f"k_{joint}"] for joint in JOINTS},
        **{key: full[key] for key in own},
    )  # fmt: skip


def responses(name: str, row: Mapping[str, Any], *, step: float | None = None) -> dict[str, float]:
    """One true run on a proving ground, see `responses_of`; step: s, None for that of the row's level."""
    t_end, case = TIMES[name], case_of(name, row)
    step = STEPS[case.level] if step is None else step
    return responses_of(simulate(system(case), np.zeros(0), t_end, round(t_end / step)))


def braking_gunner(**row: Any) -> dict[str, float]:
    """Responses in severe braking, 1.5 s."""
    return responses("braking", row)


def step_steer_gunner(**row: Any) -> dict[str, float]:
    """Responses in a step of the steering wheel, 1 s."""
    return responses("step steer", row)


def rollover_gunner(**row: Any) -> dict[str, float]:
    """Responses in the rollover, 3 s."""
    return responses("rollover", row)

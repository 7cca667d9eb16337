"""The vehicle, alone and with the gunner, in Exudyn: check V14, and the traces kept for other tests.

`python -m tests.peers.studies.test_vehicle_exudyn` writes the traces anew.
"""

import csv
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from studies.gunner.figure import FIGURE
from studies.gunner.occupant_responses import shares_of
from tests.laws.studies.test_gunner_second_engine import CASES, TRACES, compared, of_case, traces
from tests.peers.studies.exudyn_tree import ExudynTree

pytestmark = [pytest.mark.peer, pytest.mark.slow, pytest.mark.filterwarnings("ignore::DeprecationWarning")]
STEP, EVERY = 1e-3, 0.02  # s


def by_exudyn(name: str) -> dict[str, Any]:
    """Time, roll, yaw, and g2 where there is a gunner, of a case."""
    system, t_end = of_case(name)
    tree = ExudynTree(system)
    modules = import_module("exudyn"), import_module("exudyn.itemInterface")
    time, q = tree.run(*modules, t_end, step=STEP, every=EVERY)
    found = {"time": time, "yaw": q[:, 3], "roll": q[:, 5]}
    if any(body.name == FIGURE[0] for body in system.bodies):
        found["g2"] = np.array([height(tree, row) for row in q])
    return found


def height(tree: ExudynTree, q: Any) -> float:
    """Of the gunner's mass centre in the vehicle's frame, m."""
    frames = tree.links.frames(q, 0.0 * q)
    centre = {body.name: body.centre for body in tree.body.bodies}
    shares = np.array(shares_of(tree.body))
    places = np.array([tree.links.point(frames, name, centre[name]) for name in FIGURE])
    vehicle = tree.links.point(frames, "vehicle", (0.0, 0.0, 0.0))
    seen = tree.links.axes(frames, "vehicle").T @ (shares @ places / shares.sum() - vehicle)
    return float(seen[2])


@pytest.mark.parametrize("name", CASES)
def test_exudyn_agrees_and_the_kept_traces_are_its_own(name):
    pytest.importorskip("exudyn")
    theirs, kept = by_exudyn(name), traces()[name]
    for key, history in kept.items():
        assert theirs[key] == pytest.approx(history, abs=1e-5)
    compared(name, theirs)


def main() -> None:
    """Write the traces."""
    with TRACES.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(("case", "time", "roll", "yaw", "g2"))
        for name in CASES:
            found = by_exudyn(name)
            compared(name, found)
            for i, t in enumerate(found["time"]):
                g2 = f"{found['g2'][i]:.6f}" if "g2" in found else ""
                lines.writerow((name, f"{t:.2f}", f"{found['roll'][i]:.6f}", f"{found['yaw'][i]:.6f}", g2))


if __name__ == "__main__":
    main()

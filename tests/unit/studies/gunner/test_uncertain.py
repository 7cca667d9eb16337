"""Rows of uncertain parameters, and the start that a gunner without muscles settles into."""

import numpy as np
import pytest

from studies.gunner.cab import straight
from studies.gunner.cases import Case, system
from studies.gunner.figure import FIGURE
from studies.gunner.uncertain import NOMINAL, case_of, proving_ground
from workbench.engine import simulate


def test_a_settled_gunner_hangs_on_seat_and_hands_at_rest():
    """Section 4.4 of the note: 29 mm back, 17 mm down, 45 N on each hand."""
    still = system(Case(on=straight(), start="settled"))
    run = simulate(still, np.zeros(0), t_end=0.01, steps=10)
    assert np.abs(run.acceleration).max() < 1e-6
    mass = {body.name: body.mass for body in still.bodies}
    view = run.view(bodies=FIGURE, reference="vehicle", shares=tuple(mass[name] for name in FIGURE))
    assert view.series()[0] - (-1.8554, -0.041, 1.7576) == pytest.approx((-0.029, 0.0, -0.017), abs=1e-3)
    forces = [np.linalg.norm(run.bushing_force(f"{side} grip")[0]) for side in ("left", "right")]
    assert forces == pytest.approx([45.0, 45.0], abs=1.0)


@pytest.mark.slow
def test_with_soft_elbows_there_is_no_settled_start():
    with pytest.raises(ValueError, match="a settled gunner sinks through his seat: start='settled' needs"):
        system(Case(on=straight(), start="settled", factors={"elbow": 0.5}))


def test_a_row_names_what_is_uncertain():
    case = case_of("rollover", {"grip": 371.0, "k_elbow": 0.5, "hands": "one", "friction": 1.1})
    assert (case.grip, case.hands, case.factors["elbow"], case.factors["knee"]) == (371.0, "one", 0.5, 1.0)
    assert (case.seat_rate, case.seat_damping, case.on.ground.friction) == (20_000.0, 1000.0, 1.1)
    assert case_of("braking", {"deceleration": 9.0}).on.manoeuvre.braking(1.0) == 9.0
    assert case_of("step steer", {"turn": 90.0}).on.manoeuvre.steering(1.0) == pytest.approx(np.pi / 2)
    assert case_of("braking", {}).seat_rate is None
    assert set(NOMINAL) > {"k_hip_tz", "seat_cap", "mass", "start"}
    with pytest.raises(ValueError, match=r"a row takes grip, hands, .*, got elbow"):
        case_of("braking", {"elbow": 2.0})
    with pytest.raises(ValueError, match="manoeuvre needs one of braking, step steer, rollover, got 'loop'"):
        proving_ground("loop", {})


def test_the_room_hands_out_its_public_names():
    import studies.gunner

    assert studies.gunner.system is system
    assert callable(studies.gunner.responses)
    with pytest.raises(AttributeError, match=r"module 'studies\.gunner' has no attribute 'box'"):
        _ = studies.gunner.box

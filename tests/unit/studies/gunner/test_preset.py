"""The source's worst case beside the worst over everything: its space, one run, and how much it covers."""

from types import SimpleNamespace

import pytest

from studies.gunner.checks.preset import ANY, ASKED, PRESET, Beside, lines, look, space
from studies.gunner.uncertain import NOMINAL


def test_everything_that_is_uncertain_is_a_row_of_the_model():
    for ground, _, _ in ASKED:
        free, held = space(ground), space(ground, hands=("both",))
        assert set(free.names) - set(held.names) == {"hands"}
        assert set(free.names) <= set(NOMINAL)
        assert {"grip", "seat_rate", "mass", "k_ankle"} <= set(held.names)
    assert "friction" in space("rollover").names
    assert "friction" not in space("braking").names
    assert set(PRESET) <= set(NOMINAL)


def test_the_preset_is_no_worst_case_of_braking():
    """It moves him by 4 mm more than the nominal case; a light seat and soft joints let him go."""
    nominal, preset = look("braking", {}), look("braking", PRESET)
    assert nominal["deviation"] == pytest.approx(0.1379, abs=5e-4)
    assert preset["deviation"] == pytest.approx(0.1420, abs=5e-4)
    bad = {"grip": 350.0, "k_shoulder_tx": 0.5, "k_elbow": 0.683, "seat_rate": 5e3, "seat_cap": 500.0,
           "mass": 95.0, "deceleration": 8.5}  # fmt: skip
    assert look("braking", bad)["deviation"] > 2.0


def test_how_far_the_preset_goes_is_told():
    found = SimpleNamespace(parameters={"grip": 350.0, "hands": "none"}, grade_sentence="Searched: so far.")
    one = Beside(ground="braking", response="deviation", nominal=1.0, preset=1.5, worst=3.0, found=found)
    assert one.covered == 0.25
    assert lines(one, ANY)[0].endswith("worst 3.0000; the preset goes 25 % of the way")
    assert "hands both" in lines(one, ("both",))[0]
    assert lines(one, ANY)[1:] == ["    at {'grip': 350.0, 'hands': 'none'}", "    Searched: so far."]

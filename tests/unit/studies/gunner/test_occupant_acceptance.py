"""The gunner's acceptance table: what is met, and which misses are known."""

import pytest

from studies.gunner import occupant_acceptance
from studies.gunner.occupant_acceptance import at_rest, main, table

MISSES = {
    ("s12", "vehicle, deviation"),
    ("s12", "vehicle, forward"),
    ("s12", "vehicle, force of a hand"),
    ("G4", "balanced: ejected, 500 - 350 N"),
    ("G4", "torque-free: g2, 350 - 500 N"),
    ("G9", "grip that is ejected first"),
}


def test_at_rest_and_straight_on_he_is_as_asked(capsys, monkeypatch):
    rows = table((at_rest,))
    assert [row for row in rows if not row.passes] == []
    monkeypatch.setattr(occupant_acceptance.table, "__defaults__", ((at_rest,),))
    main()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4
    assert lines[0].split() == ["G1", "mass", "77", "kg", "+-0.0001", "%", "77", "pass"]


@pytest.mark.slow
def test_all_checks_are_met_but_those_that_are_named():
    assert {(row.check, row.what) for row in table() if not row.passes} == MISSES

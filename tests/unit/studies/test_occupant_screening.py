"""The tally of screenings counts what the screenings say."""

import pytest

from studies.occupant_screening import DESIGNS, INERT, tallies


@pytest.mark.slow
def test_one_seed_of_every_design_bare_and_restrained(tmp_path):
    found = list(tallies(1, folder=str(tmp_path)))
    assert [(t.design, t.restrained) for t in found] == [(d, r) for d in DESIGNS for r in (False, True)]
    for tally in found:
        assert tally.selected["hands"] == 1
        assert tally.clean == (1 if not any(tally.selected[name] for name in INERT) else 0)

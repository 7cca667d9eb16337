"""Whether all runs gave the same value is a matter of their size, not of the unit of the response."""

import pytest

from workbench.search.runs.ledger import Ledger
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])


@pytest.mark.parametrize("unit", [1.0, 1e-15, 1e-200, 1e15])
def test_a_small_unit_makes_no_response_flat(unit):
    def ledger(values):
        start = [{"a": 0.1 * k, "b": 0.5, "v": v} for k, v in enumerate(values)]
        return Ledger.opened(BOX, response="v", sense="max", start=start, progress=None)

    assert not ledger([unit, 2 * unit, 3 * unit]).is_flat
    assert ledger([unit, unit, unit * (1 + 1e-15)]).is_flat
    assert ledger([0.0, 0.0, 0.0]).is_flat


def test_the_unit_of_a_response_changes_no_search():
    """In powers of two, which round nothing."""
    found = [
        worst_case(lambda a, b, unit=unit: unit * (2 * a + b * b), BOX, budget=16, seed=0)
        for unit in (1.0, 2.0**-50)
    ]
    assert found[0].status is found[1].status
    assert found[1].value == pytest.approx(2.0**-50 * found[0].value, rel=1e-6)

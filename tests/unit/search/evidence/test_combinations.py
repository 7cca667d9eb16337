"""The bounds of discrete combinations lie beyond their own runs and agree with the gap of the whole."""

from math import inf

import numpy as np
import pytest

from workbench import worst_case
from workbench.search.evidence.combinations import combinations_tried
from workbench.search.evidence.gap import Gap
from workbench.search.runs.ledger import Ledger
from workbench.search.surrogate.fitting import fit_search_model
from workbench.space.box import Parameter, Space

BOX = Space(
    [
        *(Parameter(name, lower=0.0, upper=1.0) for name in "abcde"),
        Parameter("mounts", kind="categorical", levels=["both", "left", "right"]),
    ]
)
HELD = {"both": 0.9, "left": 1.0, "right": 1.0}


def excursion(mounts, **u):  # rises towards one corner, as a push does with its force, length and mass
    return HELD[mounts] * float(np.exp(sum(u.values()) - 2.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_combination_is_bounded_below_its_own_runs_and_one_of_them_holds_the_gap(sign):
    sense = "max" if sign > 0 else "min"
    found = worst_case(lambda **u: sign * excursion(**u), BOX, sense=sense, budget=30, seed=1, tolerance=1e-9)
    told = found.audit.combinations
    assert len(told) == 3
    assert found.gap.width > 0.0
    for combination in told:
        assert sign * combination["bound"] >= sign * combination["worst"]
        assert sign * combination["bound"] <= sign * found.gap.upper
    assert max(sign * c["bound"] for c in told) == pytest.approx(sign * found.gap.upper)
    assert [c["open"] for c in told] == [sign * c["bound"] > sign * found.value for c in told]
    assert any(c["open"] for c in told)


def tried(gap, *, sense="max", space=BOX, rows=60):
    """The combinations of runs at random, none of them near the worst corner, under a stated gap."""
    u = np.random.default_rng(3).random((rows, space.dimension)) * 0.6
    u[:, -1] = np.arange(rows) % 3 / 2
    start = [{**row, "v": excursion(**row)} for row in space.rows(u)]
    ledger = Ledger.opened(space, response="v", sense=sense, start=start, progress=None)
    model = fit_search_model(ledger.where.features(ledger.u_ok), ledger.v, previous=None, seed=0)
    return combinations_tried(
        ledger, model, gap, u=ledger.u_ok, v=ledger.v, excluded=ledger.u[:0], rng=np.random.default_rng(0)
    )


def gap_of(upper, width=1.0):
    return Gap(upper=upper, width=width, coverage=0.95, kind="model-based")


def test_the_worst_place_of_a_combination_is_looked_for_in_its_corners():
    corner = float(np.exp(3.0))
    assert all(c["bound"] > 0.2 * corner for c in tried(gap_of(corner)))
    assert max(c["worst"] for c in tried(gap_of(corner))) < 0.2 * corner


def test_a_narrower_statement_of_the_whole_caps_every_combination():
    wide, worst = tried(gap_of(1e6)), max(c["worst"] for c in tried(gap_of(1e6)))
    narrow = tried(gap_of(worst, 0.0))
    assert max(c["bound"] for c in narrow) == pytest.approx(worst)
    assert not any(c["open"] for c in narrow)
    assert all(c["open"] for c in wide)


def test_a_wider_statement_of_the_whole_raises_every_combination_alike():
    told = tried(gap_of(1e6))
    assert max(c["bound"] for c in told) == pytest.approx(1e6)
    assert min(c["bound"] for c in told) > 1e6 - 50.0


def test_where_no_bound_is_known_of_the_whole_none_is_of_a_combination():
    told = tried(gap_of(inf, inf))
    assert [c["bound"] for c in told] == [None, None, None]
    assert all(c["open"] for c in told)

"""All kinds over three manoeuvres at once, beside a sequence of parts."""

import numpy as np
import pytest

from studies.gunner.restraints import at_once
from studies.gunner.restraints.at_once import BUDGETS, GROUNDS, compare, main, whole


def test_the_whole_has_all_kinds_a_budget_each_and_three_grounds():
    problem = whole()
    assert problem.members == 180 + 180 + 36
    assert problem.names == ("belts", "airbags", "retractors")
    assert problem.costs.sum(axis=1).tolist() == [180.0, 180.0, 36.0]
    assert problem.limits.tolist() == [limit for _, limit in BUDGETS]
    np.testing.assert_allclose(problem.usage(problem.start), 1.0)  # spread evenly, nothing over
    assert list(GROUNDS) == ["braking", "step steer", "rollover"]


@pytest.mark.slow
def test_at_once_is_no_worse_than_parts_for_as_many_runs(monkeypatch, capsys):
    found = compare(4)
    assert found.runs_at_once <= found.runs_in_parts <= 3 * 4 + 3
    assert found.own_start < 0.95 * found.in_parts < 0.95 * found.nothing
    assert max(found.by_ground[name][0] for name in GROUNDS) == pytest.approx(found.in_parts, rel=1e-9)
    for density in (found.parts, found.at_once):
        assert (whole().costs @ density <= [limit * (1 + 1e-9) for _, limit in BUDGETS]).all()
    monkeypatch.setattr(at_once, "compare", lambda evaluations, hands: found)
    monkeypatch.setattr("sys.argv", ["at_once", "4"])
    main()
    assert capsys.readouterr().out.startswith(
        "hands both: worst deviation without members 0.2259 m; in parts 0."
    )

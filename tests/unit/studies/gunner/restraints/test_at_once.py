"""All kinds over three manoeuvres at once, beside a sequence of parts."""

import numpy as np
import pytest

from studies.gunner.restraints import at_once
from studies.gunner.restraints.at_once import BUDGETS, GROUNDS, Compared, compare, drawn, main, whole


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
    monkeypatch.setattr(at_once, "compare", lambda evaluations, gunner_is: found)
    monkeypatch.setattr("sys.argv", ["at_once", "4"])
    main()
    assert capsys.readouterr().out.startswith(
        "hands both: worst deviation without members 0.2259 m; in parts 0."
    )


def test_drawn_gunners_are_those_of_the_rollover_and_each_is_told(monkeypatch, capsys):
    rng = np.random.default_rng(4)
    some = [drawn(rng) for _ in range(200)]
    assert {one["hands"] for one in some} == {"none", "one", "both"}
    assert all(60.0 <= one["mass"] <= 95.0 and 350.0 <= one["grip"] <= 700.0 for one in some)
    assert all(0.5 <= factor <= 2.0 for one in some for factor in one["factors"].values())
    found = Compared(
        nothing=2.0, in_parts=0.2, own_start=0.15, from_parts=0.16, runs_in_parts=63, runs_at_once=63,
        by_ground={"braking": (0.1, 0.15)}, parts=np.zeros(1), at_once=np.zeros(1),
    )  # fmt: skip
    met = []
    monkeypatch.setattr(at_once, "compare", lambda evaluations, gunner_is: met.append(gunner_is) or found)
    monkeypatch.setattr("sys.argv", ["at_once", "20", "drawn", "9", "2"])
    main()
    assert len(met) == 2
    assert met[0] != met[1]
    assert capsys.readouterr().out.count("at once 0.1500 m for 63 (-25.0 %)") == 2

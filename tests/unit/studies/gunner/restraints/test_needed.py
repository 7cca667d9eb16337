"""How much restraint the rollover asks for: who is counted, over which cases."""

from math import sqrt

import numpy as np
import pytest

from studies.gunner.restraints import needed as module
from studies.gunner.restraints.needed import HEAVY, independent_cases, lines, main, needed
from studies.gunner.uncertain import NOMINAL
from workbench.engine import EngineError
from workbench.engine.layout.formulation.problem import static_problem


class Counts:
    """He stays where the first member holds his mass; one kind of case cannot be run."""

    members = 4

    def problem(self, cases):
        assert [dict(case) for case in cases] == [{}, dict(HEAVY)]
        return static_problem(
            lambda a: (float((a[0] - 1.0) ** 2), np.r_[2.0 * (a[0] - 1.0), np.zeros(3)]),
            start=np.full(4, 0.25), budgets=[(np.ones(4), 1.0)],
        )  # fmt: skip

    def as_response(self, objective):
        return sqrt(objective)

    def responses_of_cases(self, density, cases):
        return [
            EngineError("no run") if case["hands"] == "one"
            else {"ejected": float(case["mass"] > 60 + 35 * density[0]), "deviation": case["mass"] / 100}
            for case in cases
        ]  # fmt: skip


def test_those_who_stay_are_counted_in_the_same_cases_and_failed_runs_do_not_count():
    cases = independent_cases(300)
    found = needed(45.0, cases, model=Counts())  # 45 / 180: a quarter, spread evenly
    runs = sum(case["hands"] != "one" for case in cases)
    assert [share.draws for share in found.retained] == [300, 300]
    assert found.retained[0].hits == pytest.approx(runs / 4, abs=25)
    assert found.retained[1].hits == runs
    assert found.designed == pytest.approx(0.0, abs=1e-3)
    assert found.worst == (pytest.approx(0.95, abs=0.01),) * 2
    assert lines(found).startswith(
        f" 45 belts and bags: spread evenly {found.retained[0].hits} of 300 retained ("
    )


def test_cases_are_those_of_the_rollovers_uncertainty(monkeypatch, capsys):
    cases = independent_cases(90)
    assert set(HEAVY) <= set(NOMINAL)
    assert {case["hands"] for case in cases} == {"none", "one", "both"}
    assert all(1.15 <= case["friction"] <= 1.3 and (case["grip"] - 350.0) % 7.0 == 0.0 for case in cases)
    assert cases != independent_cases(90, seed=1)
    assert cases == independent_cases(90)
    monkeypatch.setattr(module, "restraint", lambda **given: Counts())
    monkeypatch.setattr("sys.argv", ["needed", "12", "45,90"])
    main()
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["45", "90"]

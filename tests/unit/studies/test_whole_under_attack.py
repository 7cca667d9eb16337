"""Whole members beside fractions: two members with known optima, and what the study of the occupant tells."""

import numpy as np
import pytest

from studies import occupant_whole_members as occupant
from studies.occupant_braking import NOMINAL
from studies.whole_under_attack import Counted, Effort, count_members
from tests.sample_layout import ROBUST, STUDY, TwoMembers
from workbench.study.loading import parse_study

EFFORT = Effort(scenarios=2, fractions=30, whole=20, rounds=4, attack=40, outsider=90)


class Two:
    """One member of two may be there: the left one holds 1.1 against (1 + u)^2, the right one's place 0.1."""

    nominal = {"u": 0.2, "v": 0.5}

    def __init__(self, folder):
        self.space = parse_study(STUDY, path=folder / "two.toml").space

    def model(self, count):
        return TwoMembers(budget=float(count))

    def searched(self, count, cases):
        return self.model(count).problem(cases)

    def groups(self, problem):
        return []

    def spending(self, problem):
        return None


def test_both_kinds_come_to_their_optima_over_the_uncertainty(tmp_path):
    said = []
    (found,) = count_members(Two(tmp_path), [1], effort=EFFORT, tell=said.append)
    assert found.fractions == pytest.approx(ROBUST + 0.001, rel=2e-3)
    assert found.whole == pytest.approx(10.001, rel=1e-3)  # left on: 0.25 (1 + 1)^2/0.1 at the other end
    assert found.whole_density.tolist() == [1.0, 0.0]
    assert found.uniform == pytest.approx(4 / 0.6 + 0.001, rel=1e-3)
    assert found.price == pytest.approx(found.whole / found.fractions - 1)
    assert max(found.beyond) <= 2e-3
    assert 1 < found.rounds <= 4  # the nominal case and two others did not tell both ends
    assert said[0].startswith("1 members, round 1: ")
    assert said[1].startswith("attack 1 on 1 in fractions, round 1: ")


def test_the_study_takes_numbers_and_prints_a_row(monkeypatch, capsys):
    asked = {}
    row = Counted(
        count=8, uniform=0.3, fractions=0.2, whole=0.21, stated=(0.2, 0.21), beyond=(0.0, 0.004),
        whole_density=np.ones(360), anchors=0, status="LIMIT", rounds=3,
    )  # fmt: skip
    monkeypatch.setattr(
        occupant, "count_restraints", lambda counts, **given: asked.update(counts=counts, **given) or [row]
    )
    monkeypatch.setattr(
        "sys.argv", ["whole", "8", "--rounds", "3", "--scenarios", "7", "--attack", "70", "--seed", "9"]
    )
    occupant.main()
    assert (asked["counts"], asked["effort"].rounds, asked["effort"].attack) == ((8,), 3, 70)
    assert (asked["effort"].scenarios, asked["effort"].seed, asked["effort"].outsider) == (7, 9, 3000)
    assert capsys.readouterr().out == (
        "  8 members  spread evenly 0.3000  in fractions 0.2000  whole 0.2100 m  price 5.0 %  3 rounds  "
        "outsider beyond 0.0, 0.4 %  LIMIT\n"
    )


def test_the_occupants_problem_has_one_budget_and_steps_of_8_ms():
    subject = occupant.Occupant(space=None, nominal=NOMINAL)
    problem = subject.searched(12, [NOMINAL])
    assert problem.budgets == 1
    assert problem.limits.tolist() == [12.0]
    assert problem.members == subject.model(12).members == 360
    assert subject.model(12).steps == 4 * occupant.SEARCHED

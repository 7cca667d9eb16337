"""Scouts at a longer step meet a corner that an attack passes by, and what they choose is run truly."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_layout import STUDY, TwoMembers
from tests.unit.robust_layout.test_loop import run
from workbench.errors import StudyError
from workbench.models.evaluator import FunctionEvaluator
from workbench.models.protocol import ModelSpec
from workbench.robust_layout import loop
from workbench.robust_layout.oracle import LayoutOracle
from workbench.robust_layout.record import loop_status
from workbench.robust_layout.runs import LayoutRuns
from workbench.robust_layout.scouts import coarse_runs
from workbench.space.box import Space
from workbench.space.parameter import Parameter

NAMES = tuple(f"x{k}" for k in range(12))
SPACE = Space(tuple(Parameter(name, lower=0, upper=1) for name in NAMES))
HIDDEN = dict(zip(NAMES[:8], (1, 0, 1, 1, 0, 1, 0, 0), strict=True))  # one corner in 256
LAYOUT = np.array([0.5, 0.5])
CASES = [dict.fromkeys(NAMES, 1.0)]


class Cliff(TwoMembers):
    """A slope towards the corner of all ones, and a hidden corner behind a cliff on every side."""

    def __init__(self, answers=None):
        super().__init__()
        self.answers, self.coarse = answers, 0

    def value(self, case):
        broken = all(abs(case[name] - end) < 0.02 for name, end in HIDDEN.items())
        return 2.0 if broken else 0.5 + 0.5 * sum(case.values()) / len(NAMES)

    def responses(self, density, uncertain):
        return {"push": self.value(uncertain)}

    def coarsened(self, density, cases, *, threads):
        self.coarse += len(cases)
        if self.answers is not None:
            return self.answers(cases)
        return [{"push": 1.003 * self.value(case)} for case in cases]


def attacked(folder, model, *, seed=1, scouts=1200, budget=600, limit=1.02, going_on=0):
    made = []

    def run(**case):
        made.append(case)
        return model.responses(LAYOUT, case)

    where = LayoutOracle(
        model=model, space=SPACE, folder=folder, identity="cliff", budget=budget, corners=0, seed=seed,
        evaluator=lambda density: FunctionEvaluator(run), going_on=going_on,
        coarse=coarse_runs(model, threads=1), scouts=scouts,
    )  # fmt: skip
    return where.attack(LAYOUT, CASES, limit=limit, turn=1), made


def test_scouts_meet_a_corner_that_attacks_of_the_same_runs_pass_by(tmp_path):
    seeds = range(3)
    with_, without = (
        [attacked(tmp_path / f"{scouts}-{s}", Cliff(), seed=s, scouts=scouts)[0] for s in seeds]
        for scouts in (1200, 0)
    )
    assert all(found.value == 2.0 for found in with_)
    assert sum(found.value == 2.0 for found in without) <= 1
    assert all(HIDDEN.items() <= {n: round(v) for n, v in found.case.items()}.items() for found in with_)


def test_what_scouts_choose_is_run_truly_after_the_raid_and_told(tmp_path):
    model = Cliff()
    found, made = attacked(tmp_path, model)
    assert found.attack["kinds"]["scouted"] <= 16
    assert found.attack["scouts"] == model.coarse == 1200
    assert found.value == 2.0  # the true value, not that at a longer step
    assert found.runs == 240 + found.attack["kinds"]["scouted"]  # the raid, and none after: it is broken
    assert len(made) <= 1 + found.runs
    assert found.status.startswith(
        f"{found.runs} true runs of an adversary and its 1200 scouts at a longer step"
    )


def test_a_layout_that_holds_gets_the_rest_of_the_attack(tmp_path):
    found, _ = attacked(tmp_path, Cliff(), limit=3.0)
    assert found.attack["kinds"]["scouted"] == found.runs - 600 > 0
    assert found.attack["share"]["draws"] >= 140
    assert found.attack["arrived"] == 0  # no climb began at what the scouts had found


class Sawtooth(Cliff):
    """Corners are half as bad as cases just below the jumps that every parameter has inside."""

    def value(self, case):
        return sum(x if x < 0.7 else x - 0.5 for x in case.values()) / len(NAMES)


def test_scouts_beyond_twice_the_runs_of_an_attack_climb(tmp_path):
    few, many = (
        max(
            attacked(tmp_path / f"{scouts}-{s}", Sawtooth(), seed=s, scouts=scouts, budget=100)[0].value
            for s in range(2)
        )
        for scouts in (200, 2000)
    )
    assert few < 0.62 < 0.66 < many < 0.7


@pytest.mark.parametrize("scouts", [200, 201])
def test_scouts_that_climb_go_though_the_raid_has_broken_the_layout(tmp_path, scouts):
    found, _ = attacked(tmp_path, Sawtooth(), scouts=scouts, budget=100, limit=0.49)
    assert found.value > 0.49
    assert ("scouted" in found.attack["kinds"]) == (scouts > 200)
    assert found.attack["scouts"] == (scouts if scouts > 200 else 0)


def test_a_loop_that_scouts_have_tried_says_so(tmp_path):
    found, _ = attacked(tmp_path, Cliff(), limit=3.0)
    who = (
        f"{found.runs} true runs of an adversary and its 1200 scouts at a longer step found nothing more than"
    )
    assert loop_status(found, 3.0, closed=True, holds=True).startswith(who)
    assert loop_status(found, 3.0, closed=False, holds=True).startswith(who)
    kept = {key: value for key, value in found.attack.items() if key != "scouts"}
    before = loop_status(replace(found, attack=kept), 3.0, closed=True, holds=True)
    assert before.startswith(f"{found.runs} true runs of an adversary found nothing more than")


def test_scouts_are_not_sent_twice(tmp_path):
    first, again = Cliff(), Cliff()
    found, _ = attacked(tmp_path, first)
    for place in tmp_path.glob("attack-*.json"):
        place.unlink()  # as if killed between
    assert attacked(tmp_path, again)[0] == found
    assert again.coarse == 0


@pytest.mark.parametrize(
    "answers",
    [lambda cases: 1 / 0, lambda cases: [ArithmeticError("the step is too long")] * len(cases)],
    ids=["the call raises", "every case fails"],
)
def test_scouts_that_fail_leave_the_attack_as_it_is(tmp_path, answers):
    found, made = attacked(tmp_path / "failing", Cliff(answers), limit=3.0)
    plain, alone = attacked(tmp_path / "none", Cliff(), limit=3.0, scouts=0)
    assert made == alone
    assert found.attack == plain.attack
    assert found.attack["scouts"] == 0


def test_one_case_that_makes_the_call_raise_costs_its_own_answer_alone():
    def answers(cases):
        if any(case["x0"] == 0.0 for case in cases):
            raise ZeroDivisionError("division by zero")
        return [{"push": 1.0}] * len(cases)

    of = coarse_runs(Cliff(answers), threads=1)
    rows = [{**CASES[0], "x0": x} for x in (1.0, 0.0, 0.5)]
    found = of(LAYOUT)(rows, purpose="attack")
    assert [(o.status, o.error) for o in found] == [
        ("ok", ""), ("failed", "ZeroDivisionError: division by zero"), ("ok", "")
    ]  # fmt: skip


def test_a_model_that_leaves_out_answers_is_told_so(tmp_path):
    with pytest.raises(
        StudyError, match="coarsened of the layout model gave 1 answers for 64 cases; it needs"
    ):
        attacked(tmp_path, Cliff(lambda cases: [{"push": 1.0}]))


def test_a_space_that_is_run_whole_needs_no_scouts(tmp_path):
    model = Cliff()
    whole = Space(tuple(Parameter(f"x{k}", lower=0, upper=1, step=1.0) for k in range(12)))
    where = LayoutOracle(
        model=model, space=whole, folder=tmp_path, identity="cliff", budget=5000, corners=0, seed=1,
        evaluator=lambda density: FunctionEvaluator(lambda **case: model.responses(LAYOUT, case)),
        coarse=coarse_runs(model, threads=1), scouts=100,
    )  # fmt: skip
    assert where.attack(LAYOUT, CASES, limit=1.02, turn=1).attack["exhaustive"]
    assert model.coarse == 0


def test_runs_send_scouts_where_none_has_to_be_ended(tmp_path):
    spec = ModelSpec(
        kind="layout", options={"layouts": str(tmp_path), "model": "m:f", "options": {}}, folder=".",
        names=NAMES, responses={"push": None}, identity="cliff", version="1",
    )  # fmt: skip
    for model, options, is_there in (
        (Cliff(), {}, True),
        (Cliff(), {"workers": 2}, True),
        (Cliff(), {"timeout": 5.0}, False),
        (Cliff(), {"memory": 2**30}, False),
        (TwoMembers(), {}, False),
    ):
        with LayoutRuns(tmp_path, spec=spec, space=SPACE, model=model, seed=0, **options) as runs:
            assert (runs.coarse is not None) == is_there
            if runs.coarse is not None:
                (outcome,) = runs.coarse(LAYOUT)(CASES, purpose="attack")
                assert outcome.outputs == {"push": pytest.approx(1.003)}


class StopHere(Exception):
    """What is asked for is known; the loop is not needed."""


@pytest.mark.slow
@pytest.mark.parametrize(("line", "scouts"), [("", 2 * 12), ("scouts = 7\n", 7), ("scouts = 0\n", 0)])
def test_the_study_says_how_many_scouts_there_are(tmp_path, monkeypatch, line, scouts):
    asked = {}

    class Oracle(LayoutOracle):
        """Tells what it was made with."""

        def __init__(self, **options):
            asked.update(options)
            raise StopHere

    monkeypatch.setattr(loop, "LayoutOracle", Oracle)
    text = STUDY.replace("[robust_layout]\n", f"[robust_layout]\n{line}")
    budget = next(row for row in text.splitlines() if row.startswith("budget") and row != "budget = 6")
    with pytest.raises(StopHere):
        run(tmp_path, text.replace(budget, "budget = 12"))
    assert asked["scouts"] == scouts
    assert asked["coarse"] is None  # this model has no runs at a longer step


@pytest.mark.slow
@pytest.mark.parametrize(("scouts", "first"), [(2600, "look"), (2601, "attack")])
def test_where_scouts_climb_a_layout_is_attacked_at_once(tmp_path, monkeypatch, scouts, first):
    turns = []

    class Oracle(LayoutOracle):
        """Tells how each round's layout was tried first, by a model that has runs at a longer step."""

        def __init__(self, **options):
            def same_step(density):
                return options["evaluator"](density)

            super().__init__(**{**options, "coarse": same_step})

        def look(self, density, cases, *, limit, turn):
            turns.append((turn, "look"))
            return super().look(density, cases, limit=limit, turn=turn)

        def attack(self, density, cases, *, limit, turn, to_the_end=False):
            turns.append((turn, "attack"))
            return super().attack(density, cases, limit=limit, turn=turn, to_the_end=to_the_end)

    monkeypatch.setattr(loop, "LayoutOracle", Oracle)
    found, _ = run(tmp_path, STUDY.replace("[robust_layout]\n", f"[robust_layout]\nscouts = {scouts}\n"))
    assert found["closed"]
    for one in found["rounds"]:
        assert next(how for turn, how in turns if turn == one["number"]) == first
        assert one["attacked"] or first == "look"

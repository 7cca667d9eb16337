"""The outsider that attacks robust loops in other boxes, and what is counted."""

from dataclasses import replace
from importlib.resources import files
from inspect import getsource

import numpy as np
import pytest

from studies import loop_claims
from studies.left_to_gain import Left
from studies.loop_claims import (
    Claim,
    arguments,
    claim_of,
    counted,
    drawn_space,
    outsider,
    settings_of_the_demo,
)
from studies.loop_rivals import Runs, nominal
from workbench.study.loading import load_study

WHOLE = load_study(str(files("studies") / "occupant_demo.toml")).space


class Needle:
    """A layout model with a cliff in one corner of three parameters, and a slope that leads elsewhere."""

    response = "y"

    def responses(self, density, case):
        place = {
            p.name: (case[p.name] - p.lower) / (p.upper - p.lower)
            for p in WHOLE.parameters
            if p.lower is not None
        }
        bad = place["mass"] > 0.9 and place["deceleration"] > 0.9 and case["hands"] == "one"
        return {"y": place["mass"] + place["seat_cap"] - 0.5 * place["grip"] + (3.0 if bad else 0.0)}


def test_boxes_go_beyond_the_demos_in_what_loads_the_occupant_alone():
    beyond = set()
    for seed in range(20):
        space = drawn_space(np.random.default_rng(seed))
        for part, whole in zip(space.parameters, WHOLE.parameters, strict=True):
            if whole.lower is None:
                assert part == whole
                continue
            width = (part.upper - part.lower) / (whole.upper - whole.lower)
            assert 0.45 <= width <= 1.02
            if part.lower < whole.lower - 1e-9 or part.upper > whole.upper + 1e-9:
                beyond.add(part.name)
        assert space.canonical(nominal(space)) == nominal(space)
    assert beyond == set(loop_claims.MOVED)


def test_the_outsider_finds_a_cliff_in_a_corner_within_its_budget():
    runs = Runs(Needle())
    worst, case = outsider(runs, np.zeros(1), WHOLE, budget=1500, seed=4)
    assert case["hands"] == "one"
    assert worst > 4.5  # of 5
    assert runs.made <= 1500


def test_the_outsider_shares_no_code_with_the_adversary():
    assert "evidence.attack" not in getsource(loop_claims)


def claim(**changes):
    one = Claim(
        closed=True, stated=0.1, may_exceed=0.02, beaten=0.01, arrived=2, attack_runs=1500, others={},
        robust=0.1, reasons=(),
    )  # fmt: skip
    return replace(one, **changes)


def test_a_closed_loop_claims_two_per_cent_and_an_open_one_what_it_said():
    assert claim().holds
    assert not claim(beaten=0.021, may_exceed=0.3).holds
    assert claim(closed=False, beaten=0.29, may_exceed=0.3).holds
    assert not claim(closed=False, beaten=0.31, may_exceed=0.3).holds


def test_claims_are_counted():
    others = {"uniform": 0.12, "nominal only": 0.09}
    made = [
        claim(others=others), claim(others=others, beaten=0.03),
        claim(others=others, closed=False, beaten=0.2),
        claim(others=others, closed=False, may_exceed=0.3, beaten=0.2),
    ]  # fmt: skip
    assert counted(made).splitlines() == [
        "closed 2 of 4, of these beaten by more than 2 %: 1",
        "what open loops say of how far they may be off holds in 1 of 2",
        "uniform is worse by 20 % in the median, better in 0",
        "nominal only is worse by -10 % in the median, better in 4",
    ]


def test_what_was_gained_is_counted_and_told():
    said, beaten = Left(said=0.012, gained=0.01), Left(said=0.01, gained=0.021)
    made = [claim(left=said), claim(left=beaten), claim(left=beaten, reasons=("why not",))]
    assert counted(made).splitlines()[-1] == (
        "no more was gained than is said to be left in 1 of 3; 2 are green, of which 1 gained more than 2 %"
    )
    assert loop_claims._second_line(made[2]) == "left 1.00 %, gained 2.10 %; why not"
    assert loop_claims._second_line(claim(left=Left(said=None, gained=0.0))) == "left unknown, gained 0.00 %"
    assert loop_claims._second_line(claim(reasons=("why not",))) == "why not"


@pytest.mark.slow
def test_a_short_loop_is_attacked(monkeypatch):
    short = replace(settings_of_the_demo(2), scenarios=4, evaluations=3, budget=100, corners=6, rounds=1)
    monkeypatch.setattr(loop_claims, "settings_of_the_demo", lambda seed: short)
    made, spent = claim_of(2, budget=120, steps=250, corners=True, further=2)
    assert spent > 0.0
    assert list(made.others) == ["uniform", "nominal only", "50 corners"]
    assert min(made.others.values()) > 0.0
    assert made.robust >= made.stated * (1 - 1e-12)
    assert made.beaten >= 0.0
    assert made.left is not None
    assert made.left.gained >= 0.0


def test_the_command_line_is_checked(capsys):
    asked = arguments(
        ["9602", "3", "3000", "250", "corners", "--rounds", "2", "--attack", "130", "--further", "9"]
    )
    assert (asked.first, asked.loops, asked.budget, asked.steps, asked.rounds) == (9602, 3, 3000, 250, 2)
    assert (asked.beside, asked.attack, asked.further) == ("corners", 130, 9)
    assert (arguments([]).loops, arguments([]).rounds) == (8, None)
    for words, said in (
        (["1", "0"], "loops needs to be 1 or more, got 0"),
        (["1", "1", "2"], "an outsider takes at least 3 runs, got 2"),
        (["--rounds", "0"], "rounds needs to be 1 or more, got 0"),
        (["--attack", "0"], "attack needs to be 1 or more, got 0"),
        (["--further", "0"], "further needs to be 1 or more, got 0"),
        (["one"], "invalid int value: 'one'"),
    ):
        with pytest.raises(SystemExit):
            arguments(words)
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(("rounds", "kept"), [(None, 10), (2, 2)])
def test_a_loop_may_be_cut_short(monkeypatch, rounds, kept):
    class Asked(Exception):
        """The settings are known; the loop is not needed."""

    def loop(*args, settings, **others):
        raise Asked(settings.rounds)

    monkeypatch.setattr(loop_claims, "find_robust_layout", loop)
    with pytest.raises(Asked, match=f"^{kept}$"):
        claim_of(2, budget=120, steps=250, rounds=rounds)

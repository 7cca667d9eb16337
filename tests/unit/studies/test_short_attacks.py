"""Drawn models for short attacks have the slopes they say; what their loops say is counted."""

import numpy as np
import pytest

from studies import short_attacks
from studies.short_attacks import MEMBERS, WORDS, Held, arguments, counted, drawn_loads, held


@pytest.mark.parametrize("seed", range(4))
def test_slopes_are_those_of_central_differences(seed):
    model, rng = drawn_loads(seed), np.random.default_rng(seed)
    for word in WORDS:
        case = {**{name: rng.random() for name in model.names}, "word": word}
        density = rng.random(MEMBERS) / MEMBERS
        value, slopes = model.value(density, case)
        assert value == model.responses(density, case)["load"] > 0
        moved = 1e-6 * np.eye(MEMBERS)
        step = [model.value(density + d, case)[0] - model.value(density - d, case)[0] for d in moved]
        np.testing.assert_allclose(slopes, np.array(step) / 2e-6, rtol=1e-6, atol=1e-8 * value)


def test_some_loads_have_a_cliff_and_each_matters_more_under_a_word():
    made = [drawn_loads(seed) for seed in range(20)]
    assert {5, 10} <= {model.slopes.shape[1] for model in made} <= set(range(5, 11))
    cliffs = np.concatenate([model.factor for model in made])
    assert 0.25 < (cliffs > 1).mean() < 0.55
    model = next(one for one in made if one.factor.max() > 1.3)
    k = int(model.factor.argmax())
    name, at = model.names[model.cliff_at[k]], model.threshold[k]
    word = WORDS[int(model.by_word[k].argmax())]
    rest = {
        other: 0.5 + 0.5 * np.sign(slope) for other, slope in zip(model.names, model.slopes[k], strict=True)
    }
    low, high = (model._loads({**rest, name: at + side, "word": word})[k] for side in (-1e-9, 1e-9))
    assert high == pytest.approx(model.factor[k] * low, rel=1e-6)


def one(**changes):
    same = {
        "closed": False, "holds": True, "runs": 130, "stated": 9.0, "may_exceed": 0.2, "beaten": 0.1,
        "gaps": (),
    }  # fmt: skip
    return Held(**{**same, **changes})


def test_what_loops_say_is_counted_by_what_they_say():
    made = [one(), one(beaten=0.3), one(closed=True, may_exceed=0.02, beaten=0.01), one(holds=False)]
    assert counted(made).splitlines() == [
        "closed: true in 1 of 1, median of what is said 2 %",
        "held, not closed: true in 1 of 2, median of what is said 20 %",
        "open: true in 1 of 1, median of what is said 20 %",
    ]
    beside = [one(worse={"50 corners": share}) for share in (0.3, -0.01, 0.12)]
    assert counted(beside).splitlines()[-1] == (
        "50 corners: worse by 12 % in the median, at least by -1 %, better in 1 of 3"
    )


@pytest.mark.slow
def test_a_loop_with_short_attacks_says_that_they_are_short(monkeypatch):
    monkeypatch.setattr(short_attacks, "OUTSIDER", 1500)
    short = held(309, budget=130, rounds=2, rivals=True)
    assert not short.closed
    assert short.runs >= 130
    assert short.stated > 0
    assert list(short.worse) == ["uniform", "nominal only", "50 corners"]
    if short.holds:
        assert short.may_exceed == max([0.02, *(gap for gap in short.gaps[1:] if gap > 0.02)])


def test_the_command_line_is_checked(capsys):
    asked = arguments(["7", "3", "130", "400", "--rounds", "3"])
    assert (asked.first, asked.loops, asked.budgets, asked.rounds) == (7, 3, [130, 400], 3)
    assert (arguments([]).budgets, arguments([]).rivals) == ([130, 1500], False)
    for words, said in (
        (["1", "0"], "loops needs to be 1 or more, got 0"),
        (["1", "1", "0"], "budget needs to be 1 or more, got 0"),
        (["--rounds", "0"], "rounds needs to be 1 or more, got 0"),
    ):
        with pytest.raises(SystemExit) as stopped:
            arguments(words)
        assert stopped.value.code == 2
        assert said in capsys.readouterr().err

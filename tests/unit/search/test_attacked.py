"""A search whose worst case is attacked before it is reported."""

import numpy as np
import pytest

from workbench import Parameter, Space, worst_case, worst_cases
from workbench.errors import StudyError
from workbench.search.evidence.grade import Grade, fewest_runs
from workbench.search.record import Status

BOX = Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(4)])


def _sum(**x):
    return sum(x.values())


def _hidden(x0, x1, x2, x3):
    """Smooth but for one corner, where it is three times as large."""
    base = x0 + 0.5 * x1 - x2 + 0.2 * x3
    return 5.0 if min(1 - x0, 1 - x1, x2, x3) > 0.9 else base


def test_an_attack_that_finds_nothing_gives_its_grade():
    found = worst_case(_sum, BOX, budget=16, attack=1200)
    assert found.value == 4.0
    assert found.grade is Grade.ATTACKED
    assert found.attack.runs <= 1200
    assert found.attack.share.hits == 0
    assert found.grade_sentence.startswith("Attacked: ")
    assert "found nothing beyond 4; none of 300 independent cases lie beyond" in found.grade_sentence
    assert "is called attacked" not in found.grade_sentence


def test_a_short_attack_says_what_it_lacks_for_the_word():
    found = worst_case(_sum, BOX, budget=16, attack=120)
    assert found.grade is Grade.SEARCHED
    assert found.grade_sentence.startswith("Searched: 120 true runs of an adversary found nothing beyond 4; ")
    assert "less than 9.6 % of the uncertainty does" in found.grade_sentence
    assert found.grade_sentence.endswith(
        " A value is called attacked where less than 1 % of it may lie beyond, which takes an attack of "
        "about 1200 runs."
    )


def test_runs_of_an_attack_are_heard_as_they_come_and_have_numbers_of_their_own():
    """The search goes on after this attack, with numbers that no run of the attack has."""

    def hidden(x0, x1, x2, x3):
        inside = min(1 - x0, 1 - x1, x2, x3)
        higher = 3 * (inside - 0.6) if inside > 0.6 else 0.0
        return x0 + 0.5 * x1 - x2 + 0.2 * x3 + higher + (4.0 if inside > 0.7 else 0.0)

    made, heard = [], []

    def model(**x):
        made.append(x)
        return hidden(**x)

    def hear(run, best):
        heard.append((run.number, len(made), best))

    found = worst_case(model, BOX, budget=100, attack=200, seed=2, progress=hear)
    numbers = [run.number for run in found.runs]
    assert sorted(numbers) == list(range(1, found.evaluations + 1))
    assert [number for number, _, _ in heard] == list(range(1, found.evaluations + 1))
    bests = [best for _, _, best in heard]
    assert bests == sorted(bests)
    assert found.runs[-1].proposal.startswith("attack")
    assert max(later - number for number, later, _ in heard) < 60  # a batch, never the whole attack


@pytest.mark.parametrize("attack", [0, 300])
def test_what_is_flat_to_the_search_has_no_bound_and_is_not_called_constant_once_the_attack_met_more(attack):
    def clipped(**x):
        return max(0.0, 0.4 - float(np.linalg.norm(np.array(list(x.values())) - 0.35)))

    found = worst_case(clipped, BOX, budget=14, attack=attack, seed=1)
    flat = [run.value for run in found.runs if not run.proposal.startswith("attack")]
    assert set(flat) == {0.0}
    if not attack:
        assert found.status is Status.CONSTANT
        assert np.isinf(found.gap.width)
        assert "or no run met the region where it changes" in found.gap.sentence
    else:
        assert found.value > 0.2
        assert found.status is Status.BUDGET
        assert np.isfinite(found.gap.width)


def test_without_an_attack_the_grade_is_searched():
    found = worst_case(_sum, BOX, budget=16, attack=0)
    assert found.grade is Grade.SEARCHED
    assert found.attack is None
    assert "converged" not in found.grade_sentence.lower()
    assert found.to_dict()["attack"] is None


def test_what_the_attack_finds_is_the_worst_case():
    plain = worst_case(_hidden, BOX, budget=20, attack=0)
    found = worst_case(_hidden, BOX, budget=20, attack=200)
    assert plain.value < 2 < found.value == 5.0
    assert _hidden(**found.parameters) == 5.0
    assert found.attack.raised_from == plain.value
    assert f"raised the worst from {plain.value:.6g}" in found.grade_sentence
    assert found.run_key in {run.key for run in found.runs}
    assert max(found.history) == found.value


def test_runs_of_the_attack_come_after_those_of_the_search():
    plain = worst_case(_sum, BOX, budget=16, attack=0)
    found = worst_case(_sum, BOX, budget=16, attack=120)
    np.testing.assert_array_equal(found.history[: plain.evaluations], plain.history)
    assert found.evaluations <= found.budget == 136
    assert [run.number for run in found.runs] == list(range(1, found.evaluations + 1))
    assert {run.proposal.split(":")[0] for run in found.runs[plain.evaluations :]} == {"attack"}


@pytest.mark.slow
def test_by_default_no_run_is_spent_where_too_few_are_left_for_a_claim():
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    plain = worst_case(lambda a, b: a + b, space, budget=60, attack=0)
    assert plain.status is Status.CONVERGED
    assert plain.evaluations < 60
    assert worst_case(lambda a, b: a + b, space, budget=60).evaluations == plain.evaluations


@pytest.mark.slow
def test_by_default_the_attack_makes_no_more_runs_than_the_search_and_keeps_to_the_budget():
    def f(**x):
        return 3.0  # of ten inputs: the search ends after ten runs per input

    space = Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(10)])
    found = worst_case(f, space, budget=1000)
    assert found.status is Status.CONSTANT
    assert fewest_runs(10) <= found.attack.runs <= found.evaluations / 2 + 1
    assert found.grade is Grade.SEARCHED


@pytest.mark.slow
def test_a_search_that_the_attack_proved_wrong_goes_on_with_what_it_has_left():
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])

    def f(a, b):
        # as flat as can be to the search, with a slope inside a pocket of 2 % of the box
        inside = abs(a - 0.43) < 0.075 and abs(b - 0.61) < 0.075
        return 2.0 + a if inside else 1.0

    plain = worst_case(f, space, budget=60, attack=0, seed=2)
    assert plain.status is Status.CONSTANT
    reached = []
    for seed in (1, 2, 3):
        found = worst_case(f, space, budget=60, attack=150, seed=seed)
        reached.append(found.value)
        numbers = [run.proposal.startswith("attack") for run in found.runs]
        first = numbers.index(True)
        assert not all(numbers[first:])
    assert min(reached) > 2.355  # inside the pocket, whose values begin there
    assert sorted(reached)[1] > 2.4


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_where_the_attack_opens_the_gap_again_the_search_goes_on(seed):
    """A plane to all runs that are given; the attack comes upon a pit in it, no worse than its top."""

    def f(a, b):
        return a + 0.5 * b - (3.0 if max(abs(a - 0.3), abs(b - 0.6)) < 0.15 else 0.0)

    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    rows = [{"a": a, "b": b} for a in (0.0, 0.1, 0.5, 0.75, 1.0) for b in (0.0, 0.4, 0.8, 1.0)]
    start = [{**row, "y": f(**row)} for row in rows]
    found = worst_case(
        f, space, budget=24, attack=60, seed=seed, noise=False, start=start, response="y", tolerance=1e-3
    )
    own = sum(run.number > 0 and not run.proposal.startswith("attack") for run in found.runs)
    assert found.value == 1.5
    if found.status is Status.BUDGET:  # not said before the budget of the search is spent
        assert own == 24
    else:
        assert found.status is Status.CONVERGED
        assert own < 24
        assert found.gap.width < 1e-3


def test_a_finite_space_that_was_run_whole_is_proved_and_not_attacked():
    space = Space([Parameter("n", kind="integer", lower=0, upper=5)])
    found = worst_case(lambda n: float(n), space, budget=20, attack=50)
    assert found.grade is Grade.PROVED
    assert found.attack is None


def test_numbers_do_not_depend_on_the_workers_for_the_attack():
    def cases(workers):
        found = worst_case(_sum, BOX, budget=6, attack=60, workers=workers, tolerance=0.0)
        return found.attack.attempts

    one, four = cases(1), cases(4)
    assert [tuple(a.point) for a in one[:40]] == [tuple(a.point) for a in four[:40]]


@pytest.mark.slow
def test_several_responses_share_the_attack():
    found = worst_cases(
        lambda **x: {"p": sum(x.values()), "q": -sum(x.values())},
        BOX,
        {"p": "max", "q": "max"},
        budget=40,
        attack=2400,
    )
    assert found["p"].grade is found["q"].grade is Grade.ATTACKED
    assert found["p"].attack.budget == 1200


@pytest.mark.parametrize("attack", [-1, 2.5, True])
def test_a_useless_budget_of_the_attack_is_refused(attack):
    with pytest.raises(StudyError, match="attack needs a whole number of runs >= 0"):
        worst_case(_sum, BOX, attack=attack)

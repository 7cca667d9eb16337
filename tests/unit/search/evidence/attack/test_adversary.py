import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.errors import StudyError
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.evidence.attack.adversary import attack
from workbench.space.parameter import Distribution


def _cube(d, constraints=()):
    return Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(d)], constraints)


def _sum(**x):
    return sum(x.values())


def _attack(function=_sum, space=None, **options):
    given = {"value": 10.0, "budget": 80, "seed": 1, **options}
    return attack(FunctionEvaluator(function), space or _cube(4), **given)


def test_a_wrong_claim_is_beaten_with_the_run_that_beats_it():
    found = _attack(value=3.5)
    assert found.is_beaten
    assert found.largest == 4.0
    assert found.excess == pytest.approx(0.5)
    assert found.parameters == {f"x{i}": 1.0 for i in range(4)}
    run = next(a for a in found.attempts if a.outcome.key == found.run_key)
    assert run.value == 4.0
    assert "found 4, beyond 3.5" in found.sentence


def test_a_true_claim_stands_and_the_share_is_the_rule_of_three():
    found = _attack(value=4.0)
    assert not found.is_beaten
    assert found.share.draws == 20
    assert found.share.hits == 0
    assert found.share.high == pytest.approx(1 - 0.05 ** (1 / 20))
    assert found.since == found.runs <= 80
    assert "found nothing beyond 4; none of 20 independent cases lie beyond" in found.sentence


def test_a_value_beside_a_large_offset_is_told_with_the_digits_that_move():
    def offset(**x):
        return 1e9 + 1e-3 * sum(x.values())

    assert "found nothing beyond 1000000000.004; none" in _attack(offset, value=offset(x=4.0)).sentence
    beaten = _attack(offset, value=offset(x=3.5)).sentence
    assert "found 1000000000.004, beyond 1000000000.0035; " in beaten


def test_small_is_bad_where_the_sense_says_so():
    found = _attack(value=0.5, sense="min")
    assert found.largest == 0.0
    assert found.excess == pytest.approx(0.5)


def test_the_share_counts_the_independent_cases_alone():
    # half of the box lies beyond, but three quarters of the attack's runs climb
    found = _attack(lambda x0, x1, x2, x3: x0, value=0.5, budget=800)
    beyond = [a.value > 0.5 for a in found.attempts if a.kind == "interior"]
    assert found.share.hits == sum(beyond)
    assert found.share.draws == len(beyond) == 200
    assert found.share.low < 0.5 < found.share.high


def test_independent_cases_follow_the_laws():
    space = Space(
        [
            Parameter("a", distribution=Distribution("norm", {"loc": 0.0, "scale": 1.0})),
            Parameter("b", lower=0, upper=1),
        ]
    )
    found = _attack(lambda a, b: a, space, value=9.0, budget=400)
    drawn = np.array([a.outcome.parameters["a"] for a in found.attempts if a.kind == "interior"])
    assert np.mean(np.abs(drawn) < 1) == pytest.approx(0.683, abs=0.12)  # uniform between bounds: 0.32


def test_cases_are_a_function_of_the_seed_and_not_of_the_order_of_a_batch():
    class Backwards:
        def __init__(self):
            self.inner = FunctionEvaluator(_sum)

        def __call__(self, rows, *, purpose):
            return self.inner(rows[::-1], purpose=purpose)[::-1]

    def cases(found):
        return [tuple(a.point) for a in found.attempts]

    first = _attack()
    turned = attack(Backwards(), _cube(4), value=10.0, budget=80, seed=1)
    assert cases(first) == cases(turned)
    assert cases(first) != cases(_attack(seed=2))


def test_no_case_is_run_twice():
    found = _attack(budget=200)
    assert len({a.point.tobytes() for a in found.attempts}) == found.runs <= 200


def test_a_finite_space_within_the_budget_is_run_whole():
    space = Space(
        [
            Parameter("n", lower=0, upper=6, kind="integer"),
            Parameter("c", kind="categorical", levels=("a", "b", "c")),
        ]
    )
    found = _attack(lambda n, c: float(n == 3 and c == "b"), space, value=0.5, budget=21)
    assert found.is_exhaustive
    assert found.runs == 21
    assert found.largest == 1.0
    assert not _attack(lambda n, c: float(n), space, budget=20).is_exhaustive
    assert (
        "all cases that there are, found nothing beyond 9"
        in _attack(lambda n, c: 1.0, space, value=9.0).sentence
    )


def test_the_worst_of_one_level_in_many_is_found():
    space = Space([*_cube(5).parameters, Parameter("c", kind="categorical", levels=tuple("abcdefghij"))])

    def f(c, **x):
        return 5.0 + sum(x.values()) if c == "g" else sum(x.values())

    assert _attack(f, space, value=9.5, budget=150).largest == 10.0


def test_failed_runs_are_said_to_be_possible_successes():
    def f(**x):
        if sum(x.values()) > 3:
            raise ArithmeticError("no convergence")
        return sum(x.values())

    found = _attack(f, value=3.0, budget=200)
    assert not found.is_beaten
    assert found.largest > 2.8
    assert found.failures["failed"] > 0
    assert found.failing.hits > 0
    lost, draws = found.failing.hits, len(found.independent)
    assert f"none of {draws} independent cases gave a value beyond ({lost} gave none)" in found.sentence
    assert f"{found.failures['failed']} runs without a value ({found.failures['failed']} failed) may be" in (
        found.sentence
    )


def test_when_every_run_fails_nothing_is_claimed():
    def f(**x):
        raise ArithmeticError("no convergence")

    found = _attack(f, budget=20)
    assert found.largest is None
    assert "every run failed" in found.sentence
    assert found.runs == 20


def test_gradients_are_climbed_where_the_model_gives_them():
    top = {"x0": 0.31, "x1": 0.77}

    def f(**x):
        value = -sum((x[n] - t) ** 2 for n, t in top.items())
        return value, {n: -2 * (x[n] - t) for n, t in top.items()}

    found = _attack(f, _cube(2), value=0.0, budget=60)
    assert found.kinds["gradient"] > 0
    assert "pattern" not in found.kinds
    assert found.largest > -1e-4


def test_constraints_hold_for_every_case():
    found = _attack(space=_cube(4, ("x0 + x1 <= 1",)), budget=200)
    assert all(a.outcome.parameters["x0"] + a.outcome.parameters["x1"] <= 1 for a in found.attempts)
    assert found.largest == pytest.approx(3.0, abs=0.05)


def test_since_counts_from_the_last_noticeable_gain():
    found = _attack(value=0.0)
    values = np.array([a.value for a in found.attempts])
    assert found.since < found.runs - 1
    assert values[-found.since :].max() <= values[: -found.since].max() + 0.05


def test_the_document_holds_what_is_said():
    document = _attack(value=3.5).to_dict()
    assert document["runs"] == sum(document["kinds"].values())
    assert document["largest"] == 4.0
    assert document["share"]["draws"] == 20


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sense": "up"}, "sense needs 'max' or 'min', got 'up'"),
        ({"value": float("nan")}, "an attack needs a finite value to look beyond, got nan"),
        ({"budget": 0}, "the budget of an attack needs a whole number of runs >= 1, got 0"),
    ],
)
def test_useless_arguments_are_refused(options, message):
    with pytest.raises(StudyError, match=message):
        _attack(**options)


def test_a_space_without_a_case_is_refused():
    with pytest.raises(StudyError, match="no case of the space meets its constraints: loosen them"):
        _attack(space=_cube(2, ("x0 + x1 <= -1",)))


def test_scouted_cases_are_run_first_and_no_climb_begins_there():
    hidden = {f"x{k}": 0.5 for k in range(8)}

    def needle(**x):
        return 100.0 if x == hidden else _sum(**x)

    found = _attack(needle, _cube(8), value=200.0, budget=400, scouted=[hidden])
    plain = _attack(_sum, _cube(8), value=200.0, budget=400)
    assert (found.attempts[0].kind, found.attempts[0].value, found.largest) == ("scouted", 100.0, 100.0)
    assert found.kinds["scouted"] == 1
    assert found.runs == 400  # it is one of the budget
    assert found.arrived == 0 < plain.arrived

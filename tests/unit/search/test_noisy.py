"""The worst case of a model with noise: a mean of fresh runs, never the luckiest run."""

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.report.lines.statements import runs_text
from workbench.search import loop
from workbench.search import worst_case as module
from workbench.search.arguments import AMONG_NOISE
from workbench.search.evidence.grade import Grade
from workbench.search.record import Status
from workbench.search.worst_case import worst_case
from workbench.search.worst_cases import worst_cases
from workbench.space.box import Parameter, Space
from workbench.study.schema import WorstCaseTable

BOX = Space([Parameter("a", lower=-1.0, upper=2.0, unit="m"), Parameter("b", lower=0.0, upper=1.0)])
NOISE = 0.5  # a tenth of the range of the bowl


def bowl(a, b):
    return a * a - b


def noisy(seed, function=bowl, noise=NOISE):
    rng = np.random.default_rng(seed)
    return lambda **x: function(**x) + noise * rng.standard_normal()


@pytest.fixture(scope="module")
def found():
    return worst_case(noisy(3), BOX, budget=40, seed=1, noise=True)


def test_the_value_is_the_mean_of_fresh_runs_at_one_point(found):
    last = found.runs[-8:]
    assert {run.proposal for run in last} == {"repeat"}
    assert {tuple(run.parameters.items()) for run in last} == {tuple(found.parameters.items())}
    assert found.value == found.mean == pytest.approx(np.mean([run.value for run in last]))
    assert found.repeated.count == 8
    assert found.repeated.deviation == pytest.approx(np.std([run.value for run in last], ddof=1))
    assert found.evaluations == 40


def test_the_worst_point_is_found_and_its_mean_held_by_the_interval(found):
    assert found.parameters == {"a": 2.0, "b": 0.0}
    low, high = found.interval
    assert low < 4.0 < high
    assert max(run.value for run in found.runs) > high  # the luckiest run is no worst case


def test_a_declared_noise_gets_twice_the_runs_where_no_budget_is_given(monkeypatch):
    asked = []
    monkeypatch.setattr(module, "search_worst_case", lambda *given, **options: asked.append(given[2]))
    worst_case(bowl, BOX, noise=True)
    worst_case(bowl, BOX)
    worst_case(bowl, BOX, noise=True, budget=50)
    assert [arguments.budget for arguments in asked] == [120, 60, 50]


@pytest.mark.parametrize(
    ("table", "budget"),
    [({"noise": True}, 120), ({}, 60), ({"noise": False}, 60), ({"noise": True, "budget": 9}, 9)],
)
def test_the_study_does_so_too(table, budget):
    assert WorstCaseTable(response="y", **table).budget == budget
    assert AMONG_NOISE == 120


def test_the_gap_is_that_of_the_mean(found):
    assert found.gap.upper >= found.interval[1]
    assert "By the Kriging with 90 % confidence the mean could be at most" in found.gap.sentence
    assert found.grade is Grade.SEARCHED
    assert found.label == f"the mean of 8 runs, +- {found.repeated.half:.3g} with 95 % confidence"


def test_the_document_tells_the_mean_and_no_lucky_best(found):
    document = found.to_dict()
    assert document["mean"] == document["value"]
    assert document["interval"] == list(found.interval)
    assert (document["repeats"], document["noise"]) == (8, found.repeated.deviation)
    best = [h["best"] for h in document["history"]]
    assert best == sorted(best)
    assert best[-1] < max(h["value"] for h in document["history"])


def test_small_is_bad_under_noise_too():
    found = worst_case(noisy(1), BOX, sense="min", budget=40, seed=0, noise=True)
    assert found.value == pytest.approx(found.repeated.value)
    assert bowl(**found.parameters) < -0.7
    assert found.gap.upper <= found.interval[0]


def test_runs_that_disagree_at_one_point_tell_the_noise():
    start = [{"a": 0.0, "b": 0.5, "y": -0.2}, {"a": 0.0, "b": 0.5, "y": -0.7}]
    found = worst_case(noisy(2), BOX, budget=20, seed=0, start=start)
    assert found.mean is not None
    assert worst_case(noisy(2), BOX, budget=10, seed=0, start=start, noise=False).mean is None


def test_noise_is_found_out_by_one_run_made_again():
    found = worst_case(noisy(4), BOX, budget=50, seed=2)
    assert found.mean is not None
    assert found.evaluations == 50


@pytest.mark.slow
def test_an_attack_that_noise_kept_from_being_made_is_told():
    found = worst_case(noisy(4), BOX, budget=50, attack=30, seed=2)
    assert found.attack is None
    assert found.evaluations == 50
    assert found.to_dict()["grade_sentence"] == (
        "Searched: only the search has looked, by its own surrogate. The attack of 30 runs was not made: the "
        "runs have noise, and an adversary takes each for exact."
    )
    assert "attack" not in worst_case(noisy(4), BOX, budget=50, seed=2).grade_sentence


@pytest.mark.slow
def test_slight_noise_is_asked_for_late_and_found():
    """Noise of 3 % of the range: no luckiest run is reported, no gap of nearly nothing stated."""
    for seed in (0, 1):
        found = worst_case(noisy(seed, noise=0.15), BOX, budget=40, seed=seed)
        assert found.mean is not None
        assert found.evaluations == 40
        assert found.interval[0] - 0.15 < 4.0 < found.interval[1] + 0.15


def test_noise_that_is_found_out_late_leaves_its_runs_to_the_mean(monkeypatch):
    monkeypatch.setattr(loop, "looks_noisy", lambda model, least=0.25: model.chosen_at >= 13)
    found = worst_case(noisy(4), BOX, budget=21, seed=2)
    assert found.repeated.count >= 4
    assert found.evaluations == 21


def test_noise_is_not_asked_for_when_no_runs_are_left_to_average(monkeypatch):
    """A search among noise needs four runs at the point that it reports, and is refused without them."""
    monkeypatch.setattr(loop, "looks_noisy", lambda model, least=0.25: model.chosen_at >= 11)
    found = worst_case(noisy(4), BOX, budget=15, seed=2)
    assert found.mean is None
    assert found.evaluations == 15


@pytest.mark.slow
def test_a_rough_model_without_noise_is_asked_again_at_most_once():
    calls = []

    def ripple(a, b):
        calls.append((a, b))
        return a * a - b + 0.4 * np.sin(400 * a) * np.sin(300 * b)

    found = worst_case(ripple, BOX, budget=40, seed=0)
    assert found.mean is None
    assert len(calls) <= 40
    assert len(calls) - len(set(calls)) <= 1


def test_a_difference_below_the_tolerance_is_no_noise(monkeypatch):
    """A solver that sums in another order does not give the same digits twice."""
    monkeypatch.setattr(loop, "looks_noisy", lambda model, least=0.25: True)
    found = worst_case(noisy(7, noise=1e-6), BOX, budget=20, seed=0)
    assert found.mean is None
    assert found.value == pytest.approx(4.0, abs=1e-4)


def test_a_run_made_again_for_nothing_is_told_beside_the_others(monkeypatch):
    monkeypatch.setattr(loop, "looks_noisy", lambda model, least=0.25: True)
    calls = []

    def ripple(a, b):
        calls.append((a, b))
        return a * a - b + 0.4 * np.sin(400 * a) * np.sin(300 * b)

    found = worst_case(ripple, BOX, budget=16, seed=0)
    assert found.status is Status.BUDGET
    assert (len(calls), found.evaluations, found.made_again) == (16, 15, 1)
    assert runs_text(found.to_dict()) == (
        "15 runs of at most 16, and the worst run made again to see whether runs have noise"
    )
    assert worst_case(ripple, BOX, budget=16, seed=0, noise=False).made_again == 0


def test_several_responses_share_the_runs():
    pair = noisy(5, lambda a, b: a * a - b)
    rng = np.random.default_rng(6)
    found = worst_cases(
        lambda a, b: {"p": pair(a=a, b=b), "q": a + b + 0.3 * rng.standard_normal()},
        BOX, {"p": "max", "q": "min"}, budget=60, noise=True,
    )  # fmt: skip
    assert found["p"].repeated.count >= 4
    assert found["q"].interval[0] < found["q"].value < found["q"].interval[1]
    assert found["q"].value > min(run.outputs["q"] for run in found["q"].runs)


def test_a_finite_space_is_repeated_not_exhausted():
    levels = Space([Parameter("a", kind="discrete", levels=[0.0, 1.0, 2.0])])
    found = worst_case(noisy(0, lambda a: a), levels, budget=30, seed=0, noise=True)
    assert found.parameters == {"a": 2.0}
    assert found.evaluations == 30


def test_a_model_without_noise_is_told_so():
    found = worst_case(bowl, BOX, budget=25, seed=0, noise=True)
    assert (found.value, found.repeated.half) == (4.0, 0.0)
    assert "noise = false saves runs" in found.gap.sentence


def test_what_does_not_go_with_noise_is_refused():
    with pytest.raises(StudyError, match="noise=True does not go with lipschitz, which takes every run for"):
        worst_case(bowl, BOX, noise=True, lipschitz=3.0)
    with pytest.raises(
        StudyError, match="noise needs True, False, or None to find it out by the runs, got 'y'"
    ):
        worst_case(bowl, BOX, noise="y")
    with pytest.raises(StudyError, match="budget=6 is below the 8 runs that a search among noise needs"):
        worst_case(bowl, BOX, budget=6, noise=True)


def test_too_few_values_at_the_reported_point_are_said():
    calls = []

    def failing(a, b):
        calls.append(a)
        if len(calls) > 16:
            raise ValueError("no convergence")
        return a

    with pytest.raises(NotEnoughRuns, match="0 of 4 runs at the point of the largest mean gave a value"):
        worst_case(failing, BOX, budget=20, noise=True)

"""Certificates by interval enclosures, on functions whose worst case is known."""

import re

import numpy as np
import pytest

from workbench.errors import StudyError
from workbench.search.evidence.enclosure import Enclosure, enclosure_gap
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage
from workbench.stages.validation import check_study
from workbench.study.loading import load_study

ROUNDING = 1e-9
BOX = Space([Parameter("a", lower=-2.0, upper=2.0), Parameter("b", lower=-1.0, upper=3.0)])


def square(low, high):
    ends = low * low, high * high
    return (0.0 if low <= 0 <= high else min(ends)), max(ends)


def hill(a, b):
    """Two summits of height 2 at a = +-1, b = 1, as one of (a^2 - 1)^2 and (b - 1)^2."""
    return 2.0 - (a * a - 1) ** 2 - (b - 1) ** 2


def hill_between(lower, upper):
    low, high = square(lower["a"], upper["a"])
    first = square(low - 1, high - 1)
    second = square(lower["b"] - 1, upper["b"] - 1)
    return 2.0 - first[1] - second[1], 2.0 - first[0] - second[0]


def test_an_enclosure_closes_the_gap_of_a_search():
    found = worst_case(hill, BOX, budget=24, seed=0, enclosure=Enclosure(hill_between))
    assert found.gap.kind == "enclosure"
    assert found.gap.closed
    assert 2.0 - found.value <= found.gap.width + ROUNDING
    assert found.gap.width < 1e-2
    assert found.gap.calls <= 2000


def test_small_is_bad_is_certified_too():
    found = worst_case(
        lambda a, b: -hill(a, b),
        BOX,
        sense="min",
        budget=24,
        seed=0,
        enclosure=Enclosure(lambda low, high: tuple(-x for x in hill_between(low, high)[::-1])),
    )
    assert found.gap.closed
    assert found.gap.upper <= -2.0 + ROUNDING <= found.value + ROUNDING


@pytest.mark.parametrize("calls", [1, 7, 50, 400])
def test_a_bound_that_did_not_close_still_holds_and_says_so(calls):
    where = SearchSpace.of(BOX)
    u = where.unit([{"a": 0.4, "b": 0.7}])
    v = np.array([hill(0.4, 0.7)])
    gap = enclosure_gap(where, Enclosure(hill_between, calls=calls), u=u, v=v, tolerance=1e-6)
    assert gap.calls <= calls
    assert not gap.closed
    assert gap.upper >= 2.0 - ROUNDING  # the run is not the worst case, so no bound can close on it
    assert not gap.closed
    assert gap.to_dict()["closed"] is False


def test_more_calls_narrow_the_bound():
    def loosely(lower, upper):
        """The powers expanded, so that a appears twice: bounds of a box are too wide by its width."""
        a = square(lower["a"], upper["a"])
        a2 = square(*a)
        b = square(lower["b"] - 1, upper["b"] - 1)
        return 1.0 + 2 * a[0] - a2[1] - b[1], 1.0 + 2 * a[1] - a2[0] - b[0]

    where = SearchSpace.of(BOX)
    u, v = where.unit([{"a": 1.0, "b": 1.0}]), np.array([2.0])
    widths = [enclosure_gap(where, Enclosure(loosely, n), u=u, v=v).width for n in (1, 50, 800)]
    assert widths[0] > widths[1] > widths[2]
    assert 0 < widths[2] < 0.05


def test_idle_inputs_do_not_drown_the_halving():
    names = [f"x{i}" for i in range(12)]
    space = Space([Parameter(name, lower=-2.0, upper=2.0) for name in names])
    where = SearchSpace.of(space)

    def between(lower, upper):
        return hill_between(
            {"a": lower["x3"], "b": lower["x8"] + 1}, {"a": upper["x3"], "b": upper["x8"] + 1}
        )

    u, v = where.unit([dict.fromkeys(names, 0.0) | {"x3": 1.0}]), np.array([2.0])
    gap = enclosure_gap(where, Enclosure(between, calls=1000), u=u, v=v, tolerance=0.01)
    assert gap.closed


def test_levels_and_words_are_enclosed_as_they_are():
    space = Space(
        [
            Parameter("road", kind="categorical", levels=["flat", "bump"]),
            Parameter("n", kind="integer", lower=1, upper=7),
            Parameter("a", lower=0.0, upper=1.0),
        ]
    )

    def model(road, n, a):
        return (2.0 if road == "bump" else 1.0) * n - (n - 4) ** 2 + a

    def between(lower, upper):
        assert lower["road"] == upper["road"]
        factor = 2.0 if lower["road"] == "bump" else 1.0
        low, high = square(lower["n"] - 4, upper["n"] - 4)
        return factor * lower["n"] - high + lower["a"], factor * upper["n"] - low + upper["a"]

    found = worst_case(model, space, budget=20, seed=0, enclosure=Enclosure(between))
    assert found.value == 10.0
    assert found.gap.closed
    assert found.gap.width < 0.05


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda low, high: 3.0, "enclosure needs to return a pair"),
        (lambda low, high: (1.0, 0.0), "enclosure needs low <= high, got 1.0 and 0.0"),
        (lambda low, high: (0.0, float("nan")), "enclosure needs low <= high"),
        (
            lambda low, high: 1 / 0,
            "enclosure raised ZeroDivisionError: division by zero, between {'a': -2.0,",
        ),
    ],
)
def test_what_is_no_enclosure_is_said_before_the_first_run(function, words):
    calls = []
    with pytest.raises(StudyError, match=words):
        worst_case(
            lambda a, b: calls.append(a) or hill(a, b), BOX, budget=10, seed=0, enclosure=Enclosure(function)
        )
    assert not calls


def breaks_when_narrow(lower, upper):
    if upper["a"] - lower["a"] < 1.0:
        raise ZeroDivisionError("too narrow")
    return hill_between(lower, upper)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda low, high: (-9.0, 0.0), "enclosure says the response stays below 0 .* but a run there gave"),
        (breaks_when_narrow, "enclosure raised ZeroDivisionError: too narrow, between"),
    ],
)
def test_an_enclosure_that_fails_later_costs_no_run(function, words):
    found = worst_case(hill, BOX, budget=10, seed=0, enclosure=Enclosure(function))
    assert found.evaluations == 10
    assert found.gap.kind == "model-based"
    assert "the given enclosure does not hold: " in found.gap.note
    assert re.search(words, found.gap.note)


def test_one_certificate_that_fails_leaves_the_other():
    found = worst_case(hill, BOX, budget=10, seed=0, enclosure=Enclosure(breaks_when_narrow), lipschitz=200.0)
    assert found.gap.kind == "Lipschitz"
    assert "the given enclosure does not hold" in found.gap.note


STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[response]]
name = "y"
[evaluate]
engine = "inline"
[worst_case]
response = "y"
budget = 8
enclosure = "m.py:bounds"
enclosure_calls = 30
"""


def test_a_study_file_names_its_enclosure(tmp_path):
    (tmp_path / "m.py").write_text(
        "def f(a): return a * a\n"
        "def bounds(lower, upper): return lower['a'] * lower['a'], upper['a'] * upper['a']\n"
    )
    (tmp_path / "s.toml").write_text(STUDY)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        found = run_stage(campaign, "worst_case")
    assert found["value"] == 1.0
    gap = found["gap"]
    assert gap["kind"] == "enclosure"
    assert gap["closed"]
    assert gap["calls"] <= 30


def test_validate_looks_for_the_enclosure(tmp_path):
    (tmp_path / "m.py").write_text("def f(a): return a * a\ndef bound(lower, upper): return 0.0, 1.0\n")
    (tmp_path / "s.toml").write_text(STUDY)
    with pytest.raises(
        StudyError, match=r"\[worst_case\] enclosure: .*has no 'bounds'. Did you mean 'bound'"
    ):
        check_study(load_study(tmp_path / "s.toml"))


def test_calls_and_two_certificates():
    with pytest.raises(StudyError, match=r"an enclosure needs a function of \(lower, upper\), got 3"):
        Enclosure(3)
    with pytest.raises(StudyError, match="an enclosure needs calls >= 1, got 0"):
        Enclosure(hill_between, calls=0)
    found = worst_case(hill, BOX, budget=20, seed=0, enclosure=Enclosure(hill_between), lipschitz=200.0)
    assert found.gap.kind == "enclosure"  # the narrower of the two

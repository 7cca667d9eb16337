"""Spaces: the map to the unit cube, the kinds, and what is refused with which words."""

import json

import numpy as np
import pytest
from scipy import stats

from workbench.errors import StudyError
from workbench.space.bounds import CALLED_ELSEWHERE
from workbench.space.box import (
    Distribution,
    Parameter,
    Response,
    Space,
)

MIXED = Space(
    [
        Parameter("k", lower=1, upper=5, unit="N/m"),
        Parameter("r", lower=100, upper=50_000, unit="m", scale="log"),
        Parameter("n", lower=2, upper=4, kind="integer"),
        Parameter("grip", lower=350, upper=700, step=7, unit="N"),
        Parameter("size", kind="discrete", levels=(10, 2.5, 5)),
        Parameter("hands", kind="binary"),
        Parameter("road", kind="categorical", levels=("flat", "bump", "ditch")),
        Parameter("joint", baseline=12738.9, factor=(0.5, 2.0), unit="N/rad"),
    ],
    constraints=["k * n <= 12", "road != 'ditch' or hands == 1"],
)


def test_corners_of_the_cube_are_corners_of_the_box():
    low, high = MIXED.rows([np.zeros(8), np.ones(8)])
    assert low == {
        "k": 1.0, "r": 100.0, "n": 2, "grip": 350.0, "size": 2.5, "hands": 0,
        "road": "flat", "joint": 6369.45,
    }  # fmt: skip
    assert list(high.values()) == [5.0, 50_000.0, 4, 700.0, 10, 1, "ditch", 25477.8]


def test_rows_hold_plain_python_values_in_order():
    (row,) = MIXED.rows([np.full(8, 0.5)])
    assert [type(v) for v in row.values()] == [float, float, int, float, float, int, str, float]
    assert tuple(row) == MIXED.names
    json.dumps(row)


def test_a_log_scale_is_geometric():
    assert MIXED["r"].physical(np.array([0.5]))[0] == pytest.approx(np.sqrt(100 * 50_000))


def test_levels_get_equal_shares_of_the_unit_interval():
    u = (np.arange(510) + 0.5) / 510
    values, counts = np.unique(MIXED["grip"].physical(u), return_counts=True)
    assert len(values) == 51
    assert set(counts) == {10}
    assert values[3] == 371.0  # the grid of 7 N steps holds the dissertation's 371 N


def test_steps_are_written_without_rounding_dust():
    p = Parameter("x", lower=0.1, upper=0.7, step=0.1)
    assert p.physical(np.linspace(0, 1, 7)).tolist() == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]


def test_numeric_spaces_give_float_arrays_and_mixed_ones_objects():
    assert Space([Parameter("a", lower=0, upper=1)]).physical([[0.5]]).dtype == float
    assert MIXED.physical([np.zeros(8)]).dtype == object


def test_constraints_mark_unit_points():
    ones = np.ones(8)
    assert MIXED.feasible([np.zeros(8), ones]).tolist() == [True, False]
    assert MIXED.violated(MIXED.rows([ones])[0]) == "k * n <= 12"
    assert Space([Parameter("a", lower=0, upper=1)]).feasible(np.zeros((3, 1))).all()


def test_a_distribution_may_be_a_mapping_as_in_a_study_file():
    mapped = Parameter("m", distribution={"name": "norm", "loc": 80.0, "scale": 10.0})
    assert mapped == Parameter("m", distribution=Distribution("norm", {"loc": 80.0, "scale": 10.0}))
    assert mapped == Parameter.from_dict(mapped.to_dict())


def test_a_distribution_sets_missing_bounds_and_quantiles():
    p = Parameter("m", unit="kg", distribution=Distribution("norm", {"loc": 80, "scale": 10}))
    assert (p.lower, p.upper) == pytest.approx((49.0977, 110.9023), abs=1e-3)  # 80 -+ 3.0902 sd
    space = Space([p])
    assert space.quantile([[0.5]])[0, 0] == pytest.approx(80)
    draws = space.quantile((np.arange(2000) + 0.5)[:, None] / 2000)[:, 0]
    assert draws.std() == pytest.approx(10, rel=0.02)  # the cut tails take 1 % of the variance
    assert Space([Parameter("a", lower=0, upper=4)]).quantile([[0.25]])[0, 0] == 1.0


def test_the_hash_follows_what_matters_only():
    a = Space([Parameter("a", lower=0, upper=1)])
    assert a.hash == Space([Parameter("a", lower=0.0, upper=1.0, label="A")]).hash
    assert a.hash != Space([Parameter("a", lower=0, upper=1, unit="m")]).hash
    assert a.hash != Space([Parameter("a", lower=0, upper=1)], constraints=["a < 0.5"]).hash


def test_round_trip_through_json():
    law = Parameter("m", distribution=Distribution("norm", {"loc": 80, "scale": 10}), label="mass")
    for space in (MIXED, Space([law])):
        again = Space.from_dict(json.loads(json.dumps(space.to_dict())))
        assert again == space
        assert again.hash == space.hash
    assert Response("G", "kg m/s", label="peak").to_dict() == {"name": "G", "unit": "kg m/s", "label": "peak"}


def test_bounds_may_leave_out_the_baseline_that_they_are_multiples_of():
    k = Parameter("k", baseline=10.0, factor=(2.0, 3.0))
    assert (k.lower, k.upper, k.baseline) == (20.0, 30.0, 10.0)


REFUSED = [
    (
        {"lower": 5, "upper": 5, "unit": "N/m"},
        r"parameter 'k' needs lower < upper, got lower=5 and upper=5 N/m",
    ),
    ({"lower": 5}, "parameter 'k' has no upper; give lower and upper, or baseline and factor"),
    ({"lower": float("nan"), "upper": 1}, "lower needs a finite number, got nan"),
    ({"lower": "a", "upper": 1}, "lower needs a finite number, got 'a'"),
    ({"lower": True, "upper": 2}, "lower needs a finite number, got True"),
    ({"lower": -1e308, "upper": 1e308}, "too wide for a float"),
    ({"lower": 0, "upper": 1, "kind": "contin"}, "kind is one of continuous, integer"),
    ({"lower": 0, "upper": 1, "scale": "ln"}, "scale is one of linear, log, got 'ln'"),
    ({"lower": 0, "upper": 1, "scale": "log"}, "scale 'log' needs lower > 0, got 0"),
    (
        {"lower": 1, "upper": 3, "scale": "log", "kind": "integer"},
        "'log' goes with kind 'continuous' without",
    ),
    ({"lower": 0.5, "upper": 3, "kind": "integer"}, "needs whole bounds, got 0.5 and 3"),
    ({"lower": 0, "upper": 3, "kind": "integer", "step": 1}, "takes no step"),
    (
        {"lower": 0, "upper": 1, "step": 0.3},
        "whole steps must lead from lower to upper, got lower=0, upper=1",
    ),
    ({"lower": 0, "upper": 1, "step": -1}, "whole steps must lead"),
    (
        {"lower": 0, "upper": 1e9, "kind": "integer"},
        "has 1000000000 levels, at most 1000000; make it continuous",
    ),
    ({"lower": 0, "upper": 1, "levels": (1, 2)}, "levels belong to kind 'discrete' or 'categorical'"),
    ({"kind": "discrete", "levels": (1,)}, r"needs at least two different levels, got \[1\]"),
    ({"kind": "discrete", "levels": (1, "a")}, "levels needs a finite number, got 'a'"),
    ({"kind": "discrete", "levels": (1, 2), "lower": 0}, "kind 'discrete' takes no lower"),
    ({"kind": "categorical", "levels": (1, 2)}, r"needs words as levels, got \[1, 2\]"),
    ({"kind": "categorical", "levels": ("a", "b"), "scale": "log"}, "takes no scale"),
    (
        {"kind": "categorical", "levels": ("a", "b"), "baseline": "c"},
        r"baseline is one of \['a', 'b'\], got 'c'",
    ),
    (
        {"lower": 0, "upper": 1, "baseline": 3, "unit": "N/m"},
        "baseline = 3: parameter 'k' lies between 0 and 1 N/m, got 3. Correct it, or widen the bounds",
    ),
    (
        {"distribution": {"name": "norm"}, "baseline": -4.0},
        "baseline = -4.0: parameter 'k' lies between -3.09023 and 3.09023, got -4. Correct",
    ),
    ({"kind": "binary", "levels": ("on", "off")}, "for words use 'categorical'"),
    ({"factor": (0.5, 2)}, "needs a baseline and two factors"),
    (
        {"factor": (0.5, 2), "baseline": 3, "lower": 1},
        "factor goes with baseline and without lower and upper",
    ),
    ({"factor": (2, 0.5), "baseline": 3}, r"needs factor\[0\] < factor\[1\] and a baseline other than 0"),
    ({"distribution": Distribution("gauss")}, "no continuous one of scipy.stats, there it is called 'norm'"),
    (
        {"distribution": Distribution("Uniform")},
        "no continuous one of scipy.stats, there it is called 'uniform'",
    ),
    ({"distribution": Distribution("bell")}, "no continuous one of scipy.stats, such as 'norm'"),
    ({"distribution": Distribution("norm", {"mean": 3})}, "distribution 'norm' takes loc, scale, got mean"),
    ({"distribution": {"name": "norm", "mu": 3.0}}, "distribution 'norm' takes loc, scale, got mu"),
    (
        {"distribution": {"name": "beta", "a": 3.0}},
        "distribution 'beta' takes a, b, loc, scale and needs a and b, got a",
    ),
    ({"distribution": {"name": "gamma"}}, "'gamma' takes a, loc, scale and needs a, got none of them"),
    ({"distribution": {"loc": 3.0}}, r"parameter 'k': distribution needs a mapping with the name of a law"),
    ({"distribution": "norm"}, r"such as {'name': 'norm', 'loc': 80.0, 'scale': 10.0}, got 'norm'"),
    (
        {"distribution": Distribution("norm", {"loc": 1, "scale": -3})},
        "distribution 'norm' has no median with loc = 1, scale = -3: a scale is > 0",
    ),
    (
        {"distribution": Distribution("beta", {"a": -1, "b": 2})},
        "distribution 'beta' has no median with a = -1, b = 2: they do not fit",
    ),
    ({"distribution": Distribution("norm"), "kind": "integer"}, "goes with 'continuous' without step"),
]


@pytest.mark.parametrize(("given", "words"), REFUSED, ids=[words[:40] for _, words in REFUSED])
def test_what_a_parameter_refuses(given, words):
    with pytest.raises(StudyError, match=words):
        Parameter("k", **given)


@pytest.mark.parametrize("name", ["", "a b", "1x", "x-1", 7, ["a"]])
def test_names_are_python_names(name):
    with pytest.raises(StudyError, match="needs letters, digits and underscores"):
        Parameter(name, lower=0, upper=1)
    with pytest.raises(StudyError, match="response name"):
        Response(name)


def test_a_word_of_pythons_own_is_no_name():
    with pytest.raises(StudyError, match="parameter name 'for' is a word of Python's own"):
        Parameter("for", lower=0, upper=1)


def test_what_a_space_refuses():
    a, k = Parameter("a", lower=0, upper=1), Parameter("k", lower=1, upper=5, unit="N/m", step=2)
    words = Parameter("w", kind="categorical", levels=("p", "q"))
    space = Space([a, k])
    with pytest.raises(StudyError, match="parameter 'a' is given twice"):
        Space([a, a])
    with pytest.raises(StudyError, match="at least one parameter"):
        Space([])
    with pytest.raises(StudyError, match=r"no parameter 'b'; the parameters are a, k"):
        space["b"]
    with pytest.raises(StudyError, match=r"a row has 3 columns but the space has 2 parameters: a, k"):
        space.rows([[0, 0, 0]])
    with pytest.raises(StudyError, match=r"unit points form a table \(n, 2\), got an array of shape \(2,\)"):
        space.physical([0.5, 0.5])
    with pytest.raises(StudyError, match=r"unit coordinates lie in \[0, 1\], got 1.5"):
        space.rows([[0.5, 1.5]])
    with pytest.raises(StudyError, match=r"'k' lies between 1 and 5 N/m, got 6"):
        space.unit([{"a": 0, "k": 6}])
    with pytest.raises(StudyError, match=r"'k' takes 1, 3, ..., 5 N/m, got 2"):
        space.unit([{"a": 0, "k": 2}])
    with pytest.raises(StudyError, match=r"missing \['k'\], not in the space \['b'\]"):
        space.unit([{"a": 0, "b": 6}])
    with pytest.raises(StudyError, match="'a' needs numbers, got 'x'"):
        space.unit([["x", 1]])
    with pytest.raises(StudyError, match=r"takes \['p', 'q'\], got 'r'"):
        Space([words]).unit([["r"]])
    with pytest.raises(StudyError, match="parameter 'a'"):
        Space.from_dict({"parameters": [{"name": "a", "lower": 0, "upper": 1, "width": 3}]})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a +", "is not a condition such as"),
        ("a + 1", "has no comparison"),
        ("b < 1", "names 'b'; the parameters are a"),
        ("__import__('os').system('x') == 0", "only numbers, parameter names"),
        ("a.real < 1", "only numbers, parameter names"),
        ("[a][0] < 1", "only numbers, parameter names"),
        ("max(a, key=abs) < 1", "only numbers, parameter names"),
        ("(lambda: 1)() < 2", "only numbers, parameter names"),
        ("a < " + "9" * 2000, "may have 1000 characters"),
    ],
)
def test_constraints_are_conditions_and_nothing_else(text, words):
    with pytest.raises(StudyError, match=words):
        Space([Parameter("a", lower=0, upper=1)], constraints=[text])


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("0 < a < b", True),
        ("not a > b and abs(-a) == 2", True),
        ("log(a - 2) < 1", False),
        ("a ** 9999 ** 9999 > 1", False),
        ("max(a, b) >= 3 or a == 'x'", True),
        ("-a + +b / 2 < sqrt(4)", True),
    ],
)
def test_conditions_follow_arithmetic(text, holds):
    space = Space([Parameter("a", lower=0, upper=5), Parameter("b", lower=0, upper=5)], constraints=[text])
    assert (space.violated({"a": 2.0, "b": 3.0}) is None) is holds


def test_a_value_just_outside_is_told_from_bounds_that_lie_close():
    narrow = Space([Parameter("a", lower=-1e6, upper=-999999.9, unit="mm")])
    with pytest.raises(StudyError, match=r"between -1000000 and -999999.9 mm, got -1000000.3"):
        narrow.unit([{"a": -1000000.3}])
    with pytest.raises(StudyError, match=r"lower < upper, got lower=1000000000.5 and upper=1000000000 mm"):
        Parameter("a", lower=1e9 + 0.5, upper=1e9, unit="mm")


def test_laws_of_other_programs_are_told_by_names_that_there_are():
    for there in CALLED_ELSEWHERE.values():
        assert isinstance(getattr(stats, there), stats.rv_continuous)

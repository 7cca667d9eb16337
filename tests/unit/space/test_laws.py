"""The law that effects and indices are averaged over, against moments in closed form."""

import numpy as np
import pytest
from scipy import stats

from workbench.space.laws import MOST_LEVELS, input_law, input_measure
from workbench.space.parameter import Distribution, Parameter


def moments(parameter):
    """Mean and variance of the parameter's value under its measure."""
    measure = input_measure(parameter)
    values = parameter.lower + measure.points * (parameter.upper - parameter.lower)
    mean = measure.weights @ values
    return mean, measure.weights @ (values - mean) ** 2


def test_a_uniform_parameter_has_the_moments_of_its_range():
    assert moments(Parameter("p", lower=2, upper=8)) == pytest.approx((5.0, 3.0))


@pytest.mark.parametrize(
    ("law", "exact"),
    [
        (Distribution("norm", {"loc": 3.0, "scale": 1.0}), stats.norm(3, 1)),
        (Distribution("expon", {"scale": 2.0}), stats.expon(scale=2)),
        # the density is infinite at both ends
        (Distribution("beta", {"a": 0.5, "b": 0.5}), stats.beta(0.5, 0.5)),
    ],
    ids=["norm", "expon", "beta"],
)
def test_a_distribution_has_the_moments_of_its_law_between_the_bounds(law, exact):
    parameter = Parameter("p", distribution=law)
    low, high = parameter.lower, parameter.upper
    inside = {"lb": low, "ub": high, "conditional": True}
    mean = exact.expect(lambda x: x, **inside)
    variance = exact.expect(lambda x: (x - mean) ** 2, **inside)
    assert moments(parameter) == pytest.approx((mean, variance), rel=1e-3)


def test_levels_have_equal_weights():
    measure = input_measure(Parameter("k", kind="integer", lower=1, upper=3))
    assert measure.points.tolist() == [0.0, 0.5, 1.0]
    assert measure.weights.tolist() == pytest.approx([1 / 3] * 3)
    assert measure.levels


def test_more_levels_than_can_be_told_apart_are_a_continuum():
    few = input_measure(Parameter("k", kind="integer", lower=1, upper=MOST_LEVELS))
    many = input_measure(Parameter("k", kind="integer", lower=0, upper=10**6))
    assert len(few.points) == MOST_LEVELS
    assert not many.levels
    assert len(many.points) < MOST_LEVELS


def test_labels_are_left_to_the_kriging():
    assert input_measure(Parameter("m", kind="categorical", levels=("a", "b"))) is None


@pytest.mark.parametrize(
    ("parameter", "words"),
    [
        (Parameter("p", lower=0, upper=1), "uniform between the bounds"),
        (Parameter("p", lower=1, upper=9, scale="log"), "uniform between the bounds, on a log scale"),
        (Parameter("p", kind="binary"), "its 2 levels, equally likely"),
        (
            Parameter("p", distribution=Distribution("norm", {"loc": 3, "scale": 0.5})),
            "norm(loc = 3, scale = 0.5) between the bounds",
        ),
    ],
)
def test_the_law_in_words(parameter, words):
    assert input_law(parameter) == words


def test_on_a_log_scale_the_logarithm_is_uniform():
    measure = input_measure(Parameter("g", lower=1.0, upper=100.0, scale="log"))
    assert measure.weights @ measure.points == pytest.approx(0.5)
    assert np.ptp(measure.points) == pytest.approx(1.0, abs=0.01)

"""A power that rises from run to run."""

import numpy as np
import pytest

from workbench.engine.layout.continuation import raise_power
from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem


def test_the_power_is_raised_in_steps():
    w = np.linspace(1, 4, 12)

    def build(power):
        def value(a):
            stiff = 0.05 + a**power
            return float((w / stiff).sum()), -w * power * a ** (power - 1) / stiff**2

        return static_problem(value, start=np.full(12, 0.3), lower=1e-3, budgets=[(np.ones(12), 4.0)])

    path = raise_power(build, powers=(1.0, 2.0, 4.0), max_evaluations=90)
    gray = [result.grayness for result in path.results]
    assert gray[2] < gray[1] < gray[0]
    assert gray[2] < 0.6 * gray[0]
    assert path.evaluations <= 90
    assert all(result.excess <= 1e-9 for result in path.results)
    assert path.last.value <= build(4.0).evaluate(path.results[0].density).values.max()
    with pytest.raises(InvalidLayout, match=r"powers need to be positive and to rise, got \(2.0, 1.0\)"):
        raise_power(build, powers=(2.0, 1.0))
    with pytest.raises(InvalidLayout, match="at least 3 per power, 12 here, got 10"):
        raise_power(build, max_evaluations=10)

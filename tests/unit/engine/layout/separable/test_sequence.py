"""Sequences of separable approximations where limits have peaks that come and go."""

import numpy as np
import pytest

from tests.limited_layouts import limited
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.result import FIRST_ORDER, LayoutStatus

SPREAD = 3  # seed of a problem whose budget has no price on the way


@pytest.mark.parametrize("method", ["gcmma", "gsao_two_point"])
def test_limits_whose_peaks_come_and_go_are_followed(method):
    problem, limits, scenarios = limited(2, "response")
    result = optimise_layout(problem, method, max_evaluations=20, keep_iterates=True)
    counts = {len(problem.evaluate(x).limit_rows) for x in result.iterates}
    assert len(counts) > 1
    assert min(counts) >= len(limits) * len(scenarios)
    assert result.excess <= 1e-9
    first = problem.evaluate(problem.start)
    assert np.max(first.constraints) > 0 or result.value < float(np.max(first.values))


def test_a_budget_without_a_price_far_from_an_optimum_is_not_called_idle():
    problem, _, _ = limited(SPREAD, "response")
    result = optimise_layout(problem, "gcmma", max_evaluations=12)
    assert result.kkt > FIRST_ORDER
    assert result.shadow_prices == pytest.approx([0.0], abs=1e-9)
    assert problem.usage(result.density).max() < 0.999
    assert result.status is not LayoutStatus.IDLE_BUDGET

"""Load cases in threads: the same numbers, in the order of the cases, and errors come through."""

import numpy as np
import pytest

from studies.two_body import layout_problem
from workbench.engine.layout.formulation import transient
from workbench.engine.layout.formulation.transient import Scenario, TransientObjective
from workbench.engine.simulation.side_by_side import side_by_side


def test_results_keep_the_order_and_errors_come_through():
    assert side_by_side(lambda k: k * k, range(7), threads=3) == [k * k for k in range(7)]
    assert side_by_side(lambda k: k, [], threads=3) == []

    def fails(k):
        if k == 3:
            raise ValueError("case 3")
        return k

    with pytest.raises(ValueError, match="case 3"):
        side_by_side(fails, range(5), threads=2)


def test_two_cases_in_threads_give_the_numbers_of_one_after_the_other(monkeypatch):
    record = layout_problem("short")
    scenario = Scenario(
        system=record.system,
        objective=record.objective,
        t_end=record.t_end,
        steps=record.steps,
        scheme=record.scheme,
    )
    found = []
    for threads in (1, 2):
        monkeypatch.setattr(transient, "_threads", lambda scenarios, threads=threads: threads)
        twice = TransientObjective((scenario, scenario), sensitivities="adjoint")
        density = np.full(len(scenario.system.members), 0.05)
        evaluation = twice(density)
        rows = np.array([3, 40, evaluation.values.shape[1] + 17])
        found.append((evaluation.values, evaluation.gradients(rows)))
    np.testing.assert_array_equal(found[0][0], found[1][0])
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert np.abs(found[0][1]).max() > 0

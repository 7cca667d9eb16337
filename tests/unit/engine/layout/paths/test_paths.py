"""The central path where a Newton step makes the value worse and comes no further."""

import numpy as np
import pytest

from studies import trusses
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.history import Recorder
from workbench.engine.layout.paths.central_path import follow_central_path
from workbench.engine.layout.paths.secant_path import follow_paths


@pytest.mark.slow
def test_where_newton_steps_come_no_further_barrier_steps_do():
    width, height, angle = 2.870105785479387, 5.641750762815851, 2.6733164835909635
    load = ((np.cos(angle), np.sin(angle)), (width, 5 * height / 7))
    truss = trusses.ground_structure(columns=6, rows=8, width=width, height=height, loads=((load,),))
    problem = trusses.problem(truss, budgets=trusses.domain_budgets(truss, domains=2))
    alone = Recorder(problem)
    assert not follow_central_path(problem, alone, max_evaluations=150, tolerance=1e-6)
    found = optimise_layout(problem, max_evaluations=150)
    assert found.kkt <= 1e-6
    assert found.value < 0.997 * alone.best
    assert "then barrier steps" in found.strategy


def test_where_newton_steps_arrive_nothing_else_is_done():
    problem = trusses.problem(trusses.ground_structure(columns=4, rows=3))
    recorder = Recorder(problem)
    done, said = follow_paths(problem, recorder, max_evaluations=60, tolerance=1e-6)
    assert done
    assert said == "Newton steps along the central path"
    assert recorder.evaluations < 40

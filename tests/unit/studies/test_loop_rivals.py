"""The outsider of the comparison of loops: boxes inside the demo's, and the worst cases it finds."""

from importlib.resources import files

import numpy as np
import pytest

from studies.loop_rivals import KEPT, Runs, box, counting, nominal, outsider, row
from studies.occupant_braking import NOMINAL, restraint
from studies.short_attacks import drawn_loads
from workbench.engine import NotConverged
from workbench.engine.layout.bound.binding import ByScenario
from workbench.robust_layout.record import LoopSettings
from workbench.study.loading import load_study

WHOLE = load_study(str(files("studies") / "occupant_demo.toml")).space


def test_a_box_lies_inside_the_demos_and_holds_a_nominal_case():
    for seed in range(5):
        space = box(np.random.default_rng(seed))
        for part, whole in zip(space.parameters, WHOLE.parameters, strict=True):
            if whole.lower is None:
                assert part == whole
                continue
            low, high = whole.lower - 1e-9, whole.upper + 1e-9
            assert low <= part.lower < part.upper <= high
            width = (part.upper - part.lower) / (whole.upper - whole.lower)
            assert width > KEPT - 0.02  # the steps of the grip are whole
        assert space.canonical(nominal(space)) == nominal(space)


class Linear:
    """A layout model whose response is a sum over the parameters, and which fails for one level."""

    response = "y"

    def responses(self, density, case):
        if case["hands"] == "none":
            raise NotConverged("no step is short enough", 0.1)
        parts = [
            (case[p.name] - p.lower) / (p.upper - p.lower) for p in WHOLE.parameters if p.lower is not None
        ]
        return {"y": float(np.dot(parts, (-1.0) ** np.arange(len(parts)))) + float(case["hands"] == "one")}


def test_the_outsider_climbs_to_the_worst_corner_and_failures_are_none():
    runs = Runs(Linear())
    worst = outsider(runs, np.zeros(2), WHOLE, budget=600, seed=1)
    values = runs.values(np.zeros(2), worst)
    assert values[0] == pytest.approx(1.0 + (len(WHOLE.parameters) - 1 + 1) // 2)
    assert (np.diff(values) <= 0).all()
    assert runs.made <= 600
    assert not np.isfinite(runs.values(np.zeros(2), [{**worst[0], "hands": "none"}])).any()


def test_a_counted_model_counts_what_its_problems_run_and_is_searched_as_it_was():
    model = restraint(steps=250)
    counted, made = counting(model)
    assert (counted.members, counted.response) == (model.members, model.response)
    cases = [NOMINAL, {**NOMINAL, "mass": 90.0}, {**NOMINAL, "mass": 70.0}]
    problem = counted.problem(cases)
    start = problem.into_budgets(problem.start.copy())
    assert isinstance(problem.evaluate, ByScenario)  # a search by the cases that bind stays one
    values = problem.evaluate(start).values
    np.testing.assert_array_equal(values, model.problem(cases).evaluate(start).values)
    assert made == [3]
    some = problem.evaluate.of_scenarios([0, 2])(start)
    np.testing.assert_allclose(some.values, values[[0, 2]], rtol=1e-12)
    assert made == [5]
    plain, made = counting(drawn_loads(0))
    problem = plain.problem([{**{name: 0.5 for name in plain.names}, "word": "low"}])
    problem.evaluate(problem.start)
    assert not isinstance(problem.evaluate, ByScenario)
    assert made == [1]


@pytest.mark.slow
def test_a_row_judges_every_layout_over_all_cases():
    few = LoopSettings(scenarios=6, evaluations=4, budget=60, corners=12, rounds=2, tolerance=0.02)
    found = row(3, budget=60, settings=few, steps=250)
    assert found["robust"] >= found["stated"] * (1 - 1e-9)  # all cases hold the loop's own
    assert found["robust"] == pytest.approx(found["stated"] * (1 + found["excess"]), rel=0.05)
    assert min(found[name] for name in ("sample approach", "uniform", "nominal only")) > 0
    assert found["runs"] > 100
    assert restraint(steps=250).members == 360

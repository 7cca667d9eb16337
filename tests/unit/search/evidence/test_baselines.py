"""What plain ways found is told by true runs alone."""

import pytest

from workbench import Parameter, Space
from workbench.search.evidence.baselines import Baseline, measured_baselines
from workbench.search.runs.given_runs import Run
from workbench.search.worst_case import worst_case

BOX = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])


def run(key, proposal, value, number=1):
    status = "ok" if value is not None else "failed"
    return Run(key=key, number=number, proposal=proposal, parameters={}, status=status, value=value)


def test_each_way_has_its_worst_run_and_all_its_runs():
    runs = [
        run("a", "given", 1.0, 0), run("b", "given", 3.0, 0), run("c", "given", None, 0), run("d", "ei", 9.0),
        run("e", "attack: corner", 4.0), run("f", "attack: change", 8.0), run("g", "start", None),
    ]  # fmt: skip
    assert measured_baselines(runs, sign=1.0) == {
        "the runs given": Baseline(runs=3, value=3.0, run_key="b", failed=1),
        "random corners": Baseline(runs=1, value=4.0, run_key="e"),
    }
    assert measured_baselines(runs, sign=-1.0)["the runs given"].run_key == "a"


@pytest.mark.parametrize("sense", ["max", "min"])
def test_a_search_tells_none_that_is_worse_than_its_own_worst_and_all_are_runs(sense):
    made = {}

    def response(a, b):
        made[a, b] = a * (1 - b) + 0.3 * b
        return made[a, b]

    found = worst_case(response, BOX, sense=sense, budget=12, attack=100)
    assert set(found.baselines) == {"the start design", "independent draws", "random corners"}
    sign = 1.0 if sense == "max" else -1.0
    keys = {run.key: run for run in found.runs}
    for baseline in found.baselines.values():
        assert sign * baseline.value <= sign * found.value
        assert baseline.value in made.values()
        assert keys[baseline.run_key].value == baseline.value


def test_given_runs_stand_for_a_design():
    start = [{"a": 0.1, "b": 0.2, "y": 1.0}, {"a": 0.9, "b": 0.4, "y": 2.0}, {"a": 0.4, "b": 0.9, "y": 0.5}]
    found = worst_case(lambda a, b: a + b, BOX, budget=8, start=start)
    assert found.baselines["the runs given"].value == 2.0
    assert found.baselines["the runs given"].runs == 3

"""What a study would do next, and how long that takes."""

from importlib.resources import files

import pytest

from workbench.campaign.store import Store
from workbench.models.protocol import Answer
from workbench.stages.campaign import Campaign
from workbench.stages.planning import _Pace, plan_lines, plan_study
from workbench.stages.run_all import run_all, run_stage
from workbench.study.loading import load_study

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
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "y"
[evaluate]
engine = "inline"
workers = 2
[design]
kind = "lhs"
runs = 10
[screen]
response = "y"
[worst_case]
response = "y"
budget = 12
attack = 0
"""


@pytest.fixture
def study(tmp_path):
    def read(old="", new=""):
        (tmp_path / "m.py").write_text("def f(a, b):\n    return a + b * b\n")
        (tmp_path / "s.toml").write_text(STUDY.replace(old, new) if old else STUDY)
        return load_study(tmp_path / "s.toml")

    return read


def answered(study, walls):
    """A design whose first runs took so long."""
    with Campaign(study) as campaign:
        document = run_stage(campaign, "design")
        rows = [dict(zip(("a", "b"), point, strict=True)) for point in document["physical"]]
        keys = campaign.enqueue(rows, batch="design")
        for key, wall in zip(keys, walls, strict=False):
            campaign.store.finish(key, Answer(status="ok", outputs={"y": wall}, wall=wall), attempt=1)


def test_nothing_is_known_until_the_first_run(study):
    plan = plan_study(study())
    assert plan["time"]["design"] == {"runs": 10, "at_once": 2, "seconds": None}
    assert plan["seconds_left_at_most"] is None
    assert "time of design: unknown until the first run" in plan_lines(plan)


def test_the_last_attack_of_a_robust_loop_may_go_on():
    plan = plan_study(load_study(str(files("studies") / "occupant_demo.toml")))
    looks, attacks = (10 + 2) * (90 + 18), (10 + 3) * 1500
    assert plan["time"]["robust_layout"]["runs"] == looks + attacks + 3 * 100


def test_the_time_is_that_of_the_runs_left_at_the_median_pace(study):
    answered(study(), [1.0, 2.0, 2.0, 40.0, 2.0])
    plan = plan_study(study())
    assert plan["seconds_per_run"] == 2.0, "one long run is no pace"
    assert plan["time"]["design"] == {"runs": 5, "at_once": 2, "seconds": 6.0}, "three times two at once"
    assert plan["time"]["worst_case"] == {"runs": 12, "at_once": 1, "seconds": 24.0}, "one after the other"
    assert plan["seconds_left_at_most"] == 30.0
    lines = plan_lines(plan)
    assert "time of design: 6 s (5 runs, 2 at once)" in lines
    assert "time of worst case: at most 24 s (12 runs)" in lines
    assert lines[-1] == "together at most 30 s"
    batch = plan_study(study("attack = 0\n", "attack = 0\nbatch = 4\n"))
    assert batch["time"]["worst_case"]["seconds"] == 12.0


def test_a_grown_design_takes_the_time_of_its_new_runs(study):
    answered(study(), [2.0] * 10)
    plan = plan_study(study("runs = 10", "runs = 16"))
    assert plan["time"]["design"] == {"runs": 6, "at_once": 2, "seconds": 6.0}
    assert plan["runs"]["design"] == 16
    assert plan_study(study("runs = 10", "runs = 8"))["runs"]["design"] == 10, "all of them stay"
    answered(study("runs = 10", "runs = 16"), [])
    assert plan_study(study("runs = 10", "runs = 20"))["time"]["design"]["runs"] == 10, (
        "six wait, four are new"
    )


def test_what_is_up_to_date_takes_no_time(study):
    with Campaign(study()) as campaign:
        run_all(campaign)
    plan = plan_study(study())
    assert {name: stage["runs"] for name, stage in plan["time"].items()} == {"design": 0, "worst_case": 0}
    assert plan["seconds_left_at_most"] == 0.0
    assert "time of worst case: none, all its runs are there" in plan_lines(plan)
    again = plan_study(study("budget = 12", "budget = 14"))
    assert again["time"]["worst_case"]["runs"] == 14
    assert again["time"]["design"]["runs"] == 0


def test_runs_of_another_model_tell_nothing(study):
    answered(study(), [2.0] * 10)
    plan = plan_study(study("m.py:f", "m.py:g"))
    assert (plan["stored"], plan["others"], plan["seconds_per_run"]) == ({}, 10, None)
    assert plan["time"]["design"]["runs"] == 10
    assert any(line.endswith("none; 10 of other models, versions or parameters") for line in plan_lines(plan))


def test_the_loop_over_layouts_is_timed_by_its_own_runs(study, tmp_path):
    answered(study(), [2.0] * 10)
    store = Store.opened(tmp_path / "s.holdfast" / "layouts.sqlite")
    store.enqueue([("k", {"a": 1.0})], batch="loop", model="", version="1", seed=1)
    store.finish("k", Answer(status="ok", outputs={"y": 1.0}, wall=0.5), attempt=1)
    store.close()
    pace = _Pace(tmp_path / "s.holdfast", [2.0])
    assert (pace.of("robust_layout"), pace.of("robust")) == (0.5, 2.0)


def test_a_parameter_that_is_new_is_refused_by_the_plan_as_by_the_run(study):
    answered(study(), [1.0] * 10)
    added = '[[parameter]]\nname = "c"\nlower = 0\nupper = 1\nbaseline = 0.5\n[[response]]'
    document = plan_study(study("[[response]]", added))
    assert document["stored"] == {}
    assert document["refused"].startswith("10 stored runs do not serve: 'c' is new; --at-baseline")
    assert any("'c' is new" in line for line in plan_lines(document))

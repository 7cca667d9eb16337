"""Which gap is stated: of an enumeration, of certificates, of the Kriging where those fail."""

import json
import re

import pytest

from workbench.errors import StudyError
from workbench.models.readings import within
from workbench.report.lines.worst_case import worst_case_lines
from workbench.search.evidence.gap import lipschitz_gap
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.worst_case import Status, worst_case
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage

UNIT = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])
STEPS = Space([Parameter("i", kind="integer", lower=0, upper=6), Parameter("on", kind="binary")])


def test_a_lipschitz_constant_that_two_runs_refute_gives_way_to_the_kriging():
    found = worst_case(lambda a, b: a + b, UNIT, budget=12, seed=0, lipschitz=0.1)
    assert found.value == 2.0
    assert found.gap.kind == "model-based"
    words = (
        r"the given Lipschitz constant does not hold: lipschitz=0.1 is contradicted by run \d+ and run \d+"
    )
    assert found.gap.kind == "model-based"
    assert re.search(words, found.gap.note)
    assert "contradicted by run" in found.gap.note
    assert any("contradicted by" in line for line in worst_case_lines(found.to_dict()))


def test_a_lipschitz_gap_needs_a_constant():
    with pytest.raises(StudyError, match="lipschitz needs a constant > 0"):
        lipschitz_gap(SearchSpace.of(UNIT), u=UNIT.unit([[0, 0]]), v=UNIT.unit([[0, 0]])[:, 0], constant=0.0)


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
[worst_case]
response = "y"
budget = 8
lipschitz = 0.1
"""


def test_a_study_with_a_refuted_constant_is_finished(tmp_path):
    (tmp_path / "m.py").write_text("def f(a, b): return a + b\n")
    (tmp_path / "s.toml").write_text(STUDY)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        run_stage(campaign, "worst_case")
        written = json.loads((campaign.folder / "worst_case.json").read_text())
    assert written["value"] == 2.0
    assert "lipschitz=0.1 is contradicted by" in written["gap"]["note"]


def brittle(i, on):
    if i == 6:
        raise RuntimeError("diverged")
    return i + 0.5 * on


def test_points_that_failed_leave_an_enumeration_open():
    found = worst_case(brittle, STEPS, budget=30, seed=0)
    assert found.status is Status.EXHAUSTED
    assert found.evaluations == 14
    assert found.value == 5.5
    assert found.gap.kind == "enumerated"
    assert found.gap.failed == 2
    assert found.gap.coverage < 1
    assert found.gap.width > 0
    assert {c["combination"]["i"] for c in found.audit.combinations if c["open"]} <= {6}


def test_points_that_a_limit_excludes_are_not_open():
    found = worst_case(
        lambda i, on: {"load": i + on, "travel": i},
        STEPS,
        response=within("load", {"travel": (None, 4.0)}),
        budget=30,
    )
    assert found.value == 5.0
    assert found.gap.kind == "enumerated"
    assert found.gap.failed == 0
    assert not any(c["open"] for c in found.audit.combinations)


def test_the_admissible_points_of_a_grid_are_enumerated():
    grid = Space(
        [Parameter(name, kind="integer", lower=0, upper=4) for name in "ij"], constraints=("i + j <= 4",)
    )
    found = worst_case(lambda i, j: i * j + i, grid, budget=40, seed=0)
    assert found.status is Status.EXHAUSTED
    assert found.evaluations == 15
    assert found.gap.kind == "enumerated"
    assert found.gap.failed == 0
    assert len(found.audit.combinations) == 15
    assert found.audit.sentences[-1].startswith("15 discrete combinations, 0 of them")
    assert found.audit.sentences[0] == "all 3 corners were run"


@pytest.mark.parametrize("sense", ["max", "min"])
def test_a_switch_is_enumerated(sense):
    found = worst_case(lambda on: 2.0 * on, Space([Parameter("on", kind="binary")]), sense=sense, budget=5)
    assert found.value == (2.0 if sense == "max" else 0.0)
    assert found.status is Status.EXHAUSTED
    assert found.gap.width == 0.0
    assert found.audit.sentences == ["all 2 corners were run"]
    json.dumps(found.to_dict(), allow_nan=False)


def test_a_switch_of_which_one_side_fails_says_so():
    def one(on):
        if on:
            raise RuntimeError("stuck")
        return 1.0

    found = worst_case(one, Space([Parameter("on", kind="binary")]), budget=5)
    assert found.gap.failed == 1
    document = found.to_dict()
    json.dumps(document, allow_nan=False)
    assert document["gap"]["upper"] is None
    assert worst_case_lines(document)


def test_a_combination_that_no_point_may_have_is_not_counted():
    space = Space(
        [Parameter("road", kind="categorical", levels=["dry", "ice"]), Parameter("v", lower=0, upper=1)],
        constraints=("road == 'dry'",),
    )
    found = worst_case(lambda road, v: v, space, budget=12, seed=0)
    assert [c["combination"] for c in found.audit.combinations] == [{"road": "dry"}]

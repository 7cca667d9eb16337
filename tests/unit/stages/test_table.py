"""The table of stages: everything that speaks of stages is made from it."""

import pytest

from workbench.report.contents import DOCUMENTS, ENTRIES
from workbench.stages.table import STAGES, asked_stages, stage_named
from workbench.stages.work import Work
from workbench.study.loading import parse_study
from workbench.study.record import TABLES, Study

NO_STAGE = {"model", "evaluate", "report"}  # tables that say how, not what
STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m:f"
[[parameter]]
name = "k"
lower = 1
upper = 4
[[response]]
name = "y"
[screen]
response = "y"
[design]
runs = 8
"""


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.name)
def test_every_stage_has_its_work_in_the_file_of_its_name(stage):
    assert isinstance(stage.work, Work)
    assert stage.work.run.__module__ == f"workbench.stages.{stage.name}"


def test_every_table_of_a_study_that_asks_for_work_is_a_stage():
    assert {stage.name for stage in STAGES} == set(TABLES) - NO_STAGE
    assert {stage.name for stage in STAGES} <= set(Study.__dataclass_fields__)


def test_every_document_of_a_stage_stands_on_the_page_with_its_command():
    assert {stage.document for stage in STAGES} <= set(DOCUMENTS)
    named = {entry.command.removeprefix("holdfast ") for entry in ENTRIES}
    assert {stage.command for stage in STAGES} <= named


def test_the_stages_asked_for_come_in_the_order_of_the_walk():
    assert [stage.name for stage in asked_stages(parse_study(STUDY))] == ["design", "screen"]


def test_a_stage_that_does_not_exist():
    with pytest.raises(KeyError, match="polish"):
        stage_named("polish")

"""What a command proposes can be done, and how a run reads when it is shown."""

from importlib.metadata import version

import pytest

from tests.unit.terminal.test_cli import in_process
from workbench.stages.table import STAGES
from workbench.study.schema import StudySchema
from workbench.terminal.showing import run_lines

STUDY = """
[study]
name = "s"
[model]
kind = "ask"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[response]]
name = "y"
[design]
runs = 4
"""


@pytest.mark.parametrize("stage", [stage for stage in STAGES if stage.name != "design"], ids=lambda s: s.name)
def test_a_table_that_is_missing_is_proposed_with_a_key_that_it_takes(stage, tmp_path, capsys):
    (tmp_path / "s.toml").write_text(STUDY)
    code, _, err = in_process(stage.command, tmp_path / "s.toml", capsys=capsys)
    said = f"the study has no [{stage.name}] table; add one, such as [{stage.name}] {stage.first_key} = ..."
    assert (code, said in err) == (2, True)
    (table,) = [
        one for one in StudySchema.model_fields[stage.name].annotation.__args__ if one is not type(None)
    ]
    field = table.model_fields[stage.first_key]
    assert field.is_required() or stage.name == "worst_case"  # which may name several instead


def test_a_study_that_may_be_left_out_is_told_in_one_pair_of_brackets(capsys):
    usage = in_process("plan", "--help", capsys=capsys)[1].splitlines()[0]
    sets_brackets = tuple(map(int, version("typer").split(".")[:2])) >= (0, 24)
    assert usage.endswith(" [STUDY]" if sets_brackets else " STUDY")


def test_an_attempt_without_an_error_ends_without_a_colon():
    document = {
        "id": 1, "key": "ab", "status": "ok", "attempt": 2, "batch": "design", "parameters": {"a": 1.0},
        "responses": {"y": 2.0}, "histories": {}, "error": "", "log": "", "finished": None,
        "model_state": None, "files": [],
        "attempts": [
            {"attempt": 1, "status": "ok", "reason": "other reading", "error": ""},
            {"attempt": 2, "status": "failed", "reason": "retried", "error": "no convergence"},
        ],
    }  # fmt: skip
    assert run_lines(document)[-2:] == [
        "attempt 1 ok (other reading)",
        "attempt 2 failed (retried): no convergence",
    ]

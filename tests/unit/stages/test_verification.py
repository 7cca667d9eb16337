"""Stored runs made once more: identical, close, different, and the store as it was."""

import pytest

from workbench.errors import StudyError
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.validation import verification_lines, verify_runs

SPACE = Space([Parameter("a", lower=0, upper=4)])
ROWS = [{"a": 1.0}, {"a": 2.0}, {"a": 3.0}]


@pytest.mark.parametrize(
    ("shift", "counts"),
    [(0.0, (3, 0, 0)), (1e-13, (0, 3, 0)), (0.5, (0, 0, 3))],
)
def test_runs_made_once_more_are_compared(tmp_path, shift, counts):
    now = 0.0

    def model(a):
        return a + now

    with Campaign.of(model, SPACE, folder=tmp_path / "c") as campaign:
        campaign.evaluate(ROWS)
        now = shift
        found = verify_runs(campaign, 5)
        assert (found["identical"], found["close"], found["different"]) == counts
        assert [row.outputs["y"] for row in campaign.runs()] == [1.0, 2.0, 3.0]
        assert {run["state"] for run in found["runs"]} == {1}
    lines = verification_lines(found)
    words = "{} identical, {} close, {} different".format(*counts)
    assert lines[0] == f"3 of 3 stored runs made once more: {words}"
    if counts[2]:
        key = found["runs"][0]["key"][:10]
        assert lines[1] == f"run 1 ({key}) different: y = 1.0 by state 1 of the model; now y = 1.5"
        assert max(len(line) for line in lines) <= 80


def test_a_run_that_fails_now_is_different(tmp_path):
    broken = False

    def model(a):
        if broken:
            raise ValueError("no licence")
        return a

    with Campaign.of(model, SPACE, folder=tmp_path / "c") as campaign:
        with pytest.raises(StudyError, match="no stored run has a value yet; nothing to verify"):
            verify_runs(campaign, 1)
        campaign.evaluate(ROWS)
        broken = True
        found = verify_runs(campaign, 1)
    assert (found["different"], len(found["runs"])) == (1, 1)
    assert "now ValueError: no licence" in " ".join(line.strip() for line in verification_lines(found))


def test_what_others_run_is_not_verified(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(
        '[study]\nname = "s"\n[model]\nkind = "ask"\n[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n'
        '[[response]]\nname = "y"\n'
    )
    with Campaign.from_file(path) as campaign, pytest.raises(StudyError, match="'ask' is not run here"):
        verify_runs(campaign, 1)

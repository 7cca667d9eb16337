"""`[worst_case] failures` and the border of failures, on page and terminal."""

from math import inf, isfinite

import pytest

from workbench.campaign.progress import Silent
from workbench.errors import StudyError
from workbench.report.lines.worst_case import worst_case_lines
from workbench.report.writing import write_report
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage
from workbench.study.loading import parse_study

STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "failing.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[response]]
name = "load"
unit = "N"
[design]
kind = "lhs"
runs = 8
[evaluate]
engine = "inline"
[worst_case]
response = "load"
budget = 8
{more}
"""
MODEL = """
def f(a):
    if a > 0.75:
        raise ArithmeticError("step size underflow")
    return a * (1 + a)
"""


def searched(folder, more="", **listening):
    folder.mkdir(exist_ok=True)
    (folder / "failing.py").write_text(MODEL)
    (folder / "s.toml").write_text(STUDY.format(more=more))
    with Campaign.from_file(folder / "s.toml", **listening) as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        document = run_stage(campaign, "worst_case")
        lines = " ".join(line.strip() for line in worst_case_lines(document))
        return document, lines, write_report(campaign.folder).read_text()


class Listener(Silent):
    def __init__(self):
        self.best = []

    def search(self, run, budget, *, best, **others):
        if run:
            self.best.append(best)


@pytest.mark.parametrize(("sense", "worst"), [("max", inf), ("min", -inf)])
def test_whoever_listens_hears_that_a_failure_is_the_worst_so_far(tmp_path, sense, worst):
    listener = Listener()
    searched(tmp_path / sense, f'failures = "worst"\nsense = "{sense}"', progress=listener)
    assert listener.best == [worst] * 8  # a run of the design had failed
    listener = Listener()
    searched(tmp_path / f"avoid {sense}", f'sense = "{sense}"', progress=listener)
    assert all(isfinite(best) for best in listener.best)


@pytest.mark.slow
def test_page_and_terminal_say_that_the_worst_case_borders_on_failures(tmp_path):
    document, lines, page = searched(tmp_path)
    said = "The worst case borders on failures of this kind:"
    assert said in lines
    assert said in page
    assert "ArithmeticError: step size underflow" in lines
    assert "step size underflow" in page
    assert document["border"]["counted"]["draws"] == 8  # the design, which fills the box
    assert document["border"]["counted"]["low"] <= 0.25 <= document["border"]["counted"]["high"]


def test_a_failed_run_may_be_the_worst_case(tmp_path):
    document, lines, page = searched(tmp_path, 'failures = "worst"')
    said = "The worst case is a failure,"
    assert said in lines
    assert said in page
    assert document["status"] == "a run failed, which counts as worse than any value"
    after = "the 8 runs after it are an even sample that says how much of the box fails"
    assert f"stopped because {document['status']}; {after}" in lines
    assert f"Why the search ended: {document['status']}; {after}." in page
    assert "confirms the worst case" not in page
    assert document["failure"]["parameters"]["a"] > 0.75
    assert document["parameters"]["a"] <= 0.75
    assert document["border"]["parameters"]["a"] > 0.75
    assert document["border"]["counted"]["draws"] == 16


def test_what_failures_may_be_is_said_with_the_key(tmp_path):
    with pytest.raises(StudyError, match="failures"):
        parse_study(STUDY.format(more='failures = "count"'), path=tmp_path / "s.toml")

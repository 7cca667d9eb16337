"""A report on documents of a study that is not the one there is now."""

import json

import pytest
from typer.testing import CliRunner

from tests.unit.stages.test_settled import STUDY as DESIGN_ONLY
from workbench.campaign.view import AsOf, CampaignView
from workbench.stages import run_all
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import outdated_sentence
from workbench.study.loading import load_study
from workbench.system.one_writer import Holder
from workbench.terminal.cli import app

STUDY = f"""{DESIGN_ONLY}
[screen]
response = "y"
[worst_case]
response = "y"
budget = 12
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    (folder / "m.py").write_text("def f(a):\n    return a - a**2")
    (folder / "s.toml").write_text(STUDY)
    with Campaign.from_file(folder / "s.toml") as campaign:
        campaign.run()
    return folder / "s.toml"


@pytest.fixture
def study(finished):
    yield finished
    finished.write_text(STUDY)


def told(study):
    with CampaignView.opened(load_study(study)) as view:
        return outdated_sentence(view)


CHANGES = {
    "nothing": ("", "", ()),
    "a title": ('name = "s"', 'name = "s"\ntitle = "T"', ()),
    "the budget": ("budget = 12", "budget = 13", ("worst-case",)),
    "the scale": ("[screen]", '[screen]\ntransform = "none"', ("screen",)),
    "a bound": ("upper = 1", "upper = 0.9", ("design", "screen", "worst-case")),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_is_told_after_a_change(study, change):
    old, new, stages = CHANGES[change]
    study.write_text(STUDY.replace(old, new, 1) if old else STUDY)
    said = told(study)
    if not stages:
        assert said == ""
    else:
        assert said.startswith(
            f"The study, its model or its runs changed since {' and '.join(stages)} ran: what is told of "
        )
        assert said.endswith("`holdfast run` makes it anew")


def test_a_further_run_changes_what_was_found_of_all_runs(study, tmp_path):
    with Campaign.from_file(study) as campaign:
        campaign.evaluate([{"a": 0.123}], batch="told")
    assert "since screen" in told(study)
    with Campaign.from_file(study) as campaign:
        campaign.run()
    assert told(study) == ""


def test_nothing_is_said_while_somebody_works_on_it(study, monkeypatch):
    study.write_text(STUDY.replace("budget = 12", "budget = 13"))
    assert "worst-case" in told(study)
    held = AsOf(last_answer=None, holder=Holder(owner="elsewhere||1|", since=0.0, token="t", renewed=True))
    monkeypatch.setattr(run_all, "as_of", lambda store: held)
    assert told(study) == ""


def test_terminal_page_and_json_say_it(study):
    study.write_text(STUDY.replace("upper = 1", "upper = 0.9"))
    ran = CliRunner().invoke(app, ["report", str(study), "--json"])
    assert ran.exit_code == 0
    assert json.loads(ran.stdout)["outdated"].startswith("The study, its model or its runs changed")
    folder = study.parent / "s.holdfast"
    assert (
        "<strong>Out of date.</strong> The study, its model or its runs changed"
        in (folder / "report.html").read_text()
    )
    assert "> **Out of date.** The study" in (folder / "report.md").read_text()
    study.write_text(STUDY)
    assert json.loads(CliRunner().invoke(app, ["report", str(study), "--json"]).stdout)["outdated"] == ""
    assert "Out of date." not in (folder / "report.html").read_text()

"""A finished study that is run again: nothing is read or written unless something changed; very many rows."""

import json

import pytest

from workbench.campaign import store as store_module
from workbench.report.page.folder import CampaignFolder
from workbench.report.writing import report_numbers
from workbench.sampling import stored
from workbench.stages import design, run_all
from workbench.stages.campaign import Campaign
from workbench.system.database import connected

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
[[response]]
name = "y"
[design]
runs = 9
[evaluate]
engine = "inline"
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "m.py").write_text("def f(a):\n    return 2 * a")
    (tmp_path / "s.toml").write_text(STUDY)
    return tmp_path / "s.toml"


@pytest.fixture
def reports(monkeypatch):
    """Counts reports in place of writing them."""
    made = []

    def report(campaign, **_):
        made.append(1)
        for name in ("report.html", "runs.csv"):
            (campaign.folder / name).write_text("written")
        return campaign.folder / "report.html"

    monkeypatch.setattr(run_all, "report", report)
    return made


def run(study):
    with Campaign.from_file(study) as campaign:
        return campaign.run()


def change_row(study):
    db = connected(study.parent / "s.holdfast" / "runs.sqlite")
    db.execute("UPDATE evaluation SET batch = 'told' WHERE id = 2")
    db.close()


def evaluate_more(study):
    with Campaign.from_file(study) as campaign:
        campaign.evaluate([{"a": 0.123}], batch="told")


CHANGES = {
    "a title": lambda study: study.write_text(STUDY.replace('name = "s"', 'name = "s"\ntitle = "T"', 1)),
    "a report that is gone": lambda study: (study.parent / "s.holdfast" / "report.html").unlink(),
    "an export that was edited": lambda study: (study.parent / "s.holdfast" / "runs.csv").write_text("other"),
    "another document": lambda study: (study.parent / "s.holdfast" / "motion.json").write_text("{}"),
    "a further run": evaluate_more,
    "a database that was edited": change_row,
    "more runs": lambda study: study.write_text(STUDY.replace("runs = 9", "runs = 12")),
}


def test_a_finished_study_is_left_alone(study, reports, monkeypatch):
    first = run(study)
    assert len(reports) == 1
    with monkeypatch.context() as patch:
        patch.setattr(store_module, "evaluation_of", None)  # no run is read
        again = run(study)
    assert len(reports) == 1
    assert again == json.loads(json.dumps(first))
    (study.parent / "s.holdfast" / ".settled.json").unlink()
    run(study)
    assert len(reports) == 2


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_whatever_changes_is_followed(study, reports, change):
    run(study)
    CHANGES[change](study)
    run(study)
    assert len(reports) == 2
    run(study)
    assert len(reports) == 2


def test_a_study_with_open_runs_is_not_settled(study, reports):
    run(study)
    with Campaign.from_file(study) as campaign:
        campaign.enqueue([{"a": 0.321}], batch="told")
    run(study)
    run(study)
    assert len(reports) == 3


class Listener:
    def __init__(self):
        self.seen = []

    def stage(self, name, detail):
        pass

    def runs(self, done, total, counts):
        self.seen.append((done, total))

    def note(self, text):
        pass


def test_very_many_rows_run_some_after_the_other(study, reports, monkeypatch):
    with Campaign.from_file(study) as campaign:
        run_all.run_stage(campaign, "design")
        document = json.loads((campaign.folder / "design.json").read_text())
        campaign.evaluate([{"a": document["physical"][4][0]}])
    monkeypatch.setattr(design, "AT_ONCE", 3)
    monkeypatch.setattr(store_module, "MANY", 3)
    monkeypatch.setattr(run_all, "MOST_ROWS", 5)
    listener = Listener()
    with Campaign.from_file(study, progress=listener) as campaign:
        found = campaign.run()
        assert {row.key for row in campaign.runs()} == set(document["run_keys"])
        keys = [document["run_keys"][3], "unknown", document["run_keys"][0], document["run_keys"][3], "other"]
        assert campaign.store.statuses(keys) == {keys[0]: "ok", keys[2]: "ok"}
        assert list(campaign.store.statuses(keys)) == [keys[0], keys[2]]
    assert found["evaluate"] == {"runs": 9, "counts": {"ok": 9}}
    assert listener.seen[-1] == (9, 9)
    assert {total for _, total in listener.seen} == {9}
    assert [done for done, _ in listener.seen] == sorted({done for done, _ in listener.seen})
    assert found["design"]["rows_in"] == "design.json"
    assert "run_keys" not in found["design"]


def test_the_page_of_a_large_design_leaves_its_rows_unread(study, reports, monkeypatch):
    run(study)
    folder = study.parent / "s.holdfast"
    whole = report_numbers(folder)
    monkeypatch.setattr(stored, "LARGE", 0)
    assert report_numbers(folder) == whole
    monkeypatch.setattr(stored, "MOST_ROWS", 5)
    found = CampaignFolder.opened(folder, documents=("design",))
    assert not {"unit", "physical", "run_keys", "run_ids"} & found["design"].keys()
    assert report_numbers(folder)["sections"]["runs"] == whole["sections"]["runs"]


SEVERAL = """
[study]
name = "w"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "speed"
lower = 0
upper = 1
[[parameter]]
name = "airbag"
kind = "binary"
[[parameter]]
name = "mass"
lower = 50
upper = 100
[[response]]
name = "y"
[design]
runs = 9
[evaluate]
engine = "inline"
[worst_case]
response = "y"
budget = 12
"""


def test_parameters_keep_the_order_of_the_study_when_nothing_is_left_to_do(tmp_path):
    (tmp_path / "m.py").write_text(
        "def f(speed, airbag, mass):\n"
        "    if mass > 95: raise ValueError('too heavy')\n"
        "    if speed < 0.1: return float('nan')\n"
        "    return speed - airbag + mass\n"
    )
    (tmp_path / "w.toml").write_text(SEVERAL)
    told, stages = [], tmp_path / "w.holdfast" / ".settled.json"
    for is_settled in (False, True, False):
        with Campaign.from_file(tmp_path / "w.toml") as campaign:
            if not is_settled:
                stages.unlink(missing_ok=True)
            told.append(run_all.run_lines(campaign.run()))
    assert told[0] == told[1] == told[2]
    text = "\n".join(told[0])
    assert text.index("speed  = ") < text.index("airbag = ") < text.index("mass   = ")

"""Answers of a store of a time before, too large to be modelled, count as failed and are kept."""

from workbench.campaign.progress import Silent
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage
from workbench.study.loading import load_study
from workbench.system.atomic import read_json

SPACE, ROWS = Space([Parameter("a", lower=0, upper=4)]), [{"a": 1.0}, {"a": 2.0}, {"a": 3.0}]


class Notes(Silent):
    """Keeps what a person would be told."""

    def __init__(self):
        self.said = []

    def note(self, text):
        self.said.append(text)


def test_stored_runs_too_large_to_be_modelled_are_set_aside_once(tmp_path):
    def opened():
        notes = Notes()
        return Campaign.of(lambda a: 10 * a, SPACE, folder=tmp_path / "c", progress=notes), notes.said

    campaign, said = opened()
    with campaign:
        keys = [run.key for run in campaign.evaluate(ROWS)]
        for key, y in zip(keys[1:], (6e293, 1e120), strict=True):  # as they were stored before
            campaign.store.write(
                "UPDATE evaluation SET outputs = ?, kept = NULL WHERE key = ?", [f'{{"y": {y}}}', key]
            )
        campaign.store.write("DELETE FROM meta WHERE key = 'largest value'")
    assert said == []
    campaign, said = opened()
    with campaign:
        assert said == ["1 stored run holds a number beyond 1e+140 and counts as failed"]
        runs = campaign.evaluate(ROWS)
        assert [run.status for run in runs] == ["ok", "nonfinite", "ok"]
        assert runs[1].error == (
            "too large a number: y = 6e+293 lies beyond 1e+140, as where an integration diverges"
        )
        assert runs[2].outputs == {"y": 1e120}
        kept = campaign.store.select("SELECT kept FROM evaluation WHERE key = ?", [keys[1]])
        assert kept == [('{"y": 6e+293}',)]
    campaign, said = opened()
    with campaign:
        assert said == []


BLOWN = """
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
[design]
runs = 14
[screen]
response = "y"
[evaluate]
engine = "inline"
"""
OSCILLATOR = """
def f(a, b):
    x, v, top = 1.0, 0.0, 0.0
    for _ in range(400):  # an explicit step beyond its limit where a is large
        v -= (4 + b) * x * (0.6 + a)
        x += v * (0.6 + a)
        top = max(top, abs(x))
    return top
"""


def test_a_study_whose_integration_diverges_is_screened_by_the_other_runs(tmp_path):
    (tmp_path / "m.py").write_text(OSCILLATOR)
    (tmp_path / "s.toml").write_text(BLOWN)
    with Campaign(load_study(tmp_path / "s.toml")) as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        run_stage(campaign, "screen")
        failed = campaign.failures()
    document = read_json(tmp_path / "s.holdfast" / "screening.json")
    assert set(failed) == {"nonfinite"}
    assert document["n_left_out"] == failed["nonfinite"] > 0

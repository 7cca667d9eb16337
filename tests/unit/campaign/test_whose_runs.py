"""Which stored runs are those of the campaign as the study now stands."""

from workbench.report.page.folder import CampaignFolder
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_all


def test_runs_of_another_model_of_the_same_version_are_none_of_this_campaign(tmp_path):
    text = (
        '[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "m.py:f"\n'
        '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n[[response]]\nname = "y"\n'
        '[design]\nkind = "sobol"\nruns = 4\n[evaluate]\nengine = "inline"\n'
    )
    (tmp_path / "m.py").write_text("def f(a):\n    return a\ndef g(a):\n    return 10 + a\n")
    (tmp_path / "s.toml").write_text(text)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        run_all(campaign)
    (tmp_path / "s.toml").write_text(text.replace("m.py:f", "m.py:g"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        run_all(campaign)
        assert len(campaign.store.rows()) == 8
        assert all(row.outputs["y"] >= 10 for row in campaign.runs())
        assert float(campaign.results()["y"].min()) >= 10
    folder = CampaignFolder.opened(tmp_path / "s.holdfast", documents=["design", "screening", "worst_case"])
    assert (len(folder.runs), folder.n_others) == (4, 4)
    page = (tmp_path / "s.holdfast" / "report.md").read_text()
    assert "4 more are stored, of another model, version or set of parameters" in page
    (tmp_path / "s.toml").write_text(text)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        assert all(row.outputs["y"] <= 1 for row in campaign.runs())


def test_rows_outside_the_present_bounds_are_not_asked_for(tmp_path):
    text = (
        '[study]\nname = "s"\n[model]\nkind = "ask"\n[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n'
        '[[response]]\nname = "y"\n'
    )
    (tmp_path / "s.toml").write_text(text)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        campaign.enqueue([{"a": 0.1}, {"a": 0.5}, {"a": 0.9}], batch="design")
    (tmp_path / "s.toml").write_text(text.replace("upper = 1", "upper = 0.6"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        assert [run.parameters["a"] for run in campaign.ask()] == [0.1, 0.5]
        assert [run.parameters["a"] for run in campaign.ask(1)] == [0.1]
        assert len(campaign.runs()) == 3

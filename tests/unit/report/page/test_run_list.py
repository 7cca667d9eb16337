"""The runs of a report: counted by columns, read as records where they are shown, and drawn in samples."""

from collections import Counter

import numpy as np
import pytest

from workbench.models.stored import run_chunks
from workbench.models.stored.evaluation import alike
from workbench.report.page.folder import CampaignFolder
from workbench.report.page.run_list import RunList
from workbench.report.sections import runs as section_module
from workbench.report.sections.runs import runs_section
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign

N = 60
SPACE = Space([Parameter("a", lower=0, upper=1)])


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """The folder of a campaign: 50 runs of a design, 10 of a search, every seventh failed, and its runs."""
    folder = tmp_path_factory.mktemp("c") / "c.holdfast"
    with Campaign.of(lambda a: a, SPACE, folder=folder) as campaign:
        for k in range(N):
            row = {"a": k / N}
            (key,) = campaign.enqueue([row], batch="design" if k < 50 else "worst_case")
            if k % 7 == 3:
                campaign.tell(key, failure=f"no root below {k}" if k % 2 else "it tore")
            elif k != 30:
                campaign.tell(key, (k - 40.0) ** 2)
        return folder, campaign.runs()


@pytest.fixture(params=[7, 5000])
def runs(stored, request, monkeypatch):
    monkeypatch.setattr(run_chunks, "AT_ONCE", request.param)
    return CampaignFolder.opened(stored[0], documents=("design", "worst_case", "screening")).runs


def test_counts_are_those_of_the_records(stored, runs):
    records = stored[1]
    assert len(runs) == N
    assert [run.key for run in runs] == [run.key for run in records]
    assert runs.counts == Counter(run.status for run in records) == {"failed": 9, "ok": 50, "queued": 1}
    assert list(runs.by_stage) == ["design", "worst_case"]
    assert runs.by_stage["worst_case"] == Counter(run.status for run in records[50:])
    assert len(runs.finished) == N - 1
    assert runs.last_finished == max(run.finished for run in records if run.finished is not None)
    assert runs.wall == pytest.approx(sum(run.wall or 0.0 for run in records))
    values = [run.outputs.get("y", np.nan) for run in records]
    np.testing.assert_array_equal(runs.values("y"), values)
    assert np.isnan(runs.values("z")).all()


def test_failures_are_grouped_as_those_of_the_records(stored, runs):
    groups = alike([run for run in stored[1] if run.status == "failed"])
    assert [(f.cause, f.first, f.count) for f in runs.failures] == [
        (cause, some[0].id, len(some)) for cause, some in groups
    ]
    assert [f.cause for f in runs.failures] == ["no root below …", "it tore"]


def test_a_failed_command_that_wrote_nothing_has_no_log(tmp_path):
    reason = "out.csv has no column 'q' (kept in work/3fa9)"
    with Campaign.of(lambda a: a, SPACE, folder=tmp_path / "c.holdfast") as campaign:
        (key,) = campaign.enqueue([{"a": 0.5}], batch="design")
        campaign.tell(key, failure=reason)
    (failure,) = CampaignFolder.opened(tmp_path / "c.holdfast", documents=("design",)).runs.failures
    assert failure.cause == "out.csv has no column 'q'"


def test_runs_are_found_by_their_keys(stored, runs):
    records = stored[1]
    keys = [records[k].key for k in (41, 3, 58)]
    assert {key: run.inputs for key, run in runs.named([*keys, "nobody"]).items()} == {
        records[k].key: records[k].inputs for k in (41, 3, 58)
    }
    assert [runs.number(run.key) for run in records] == [run.id for run in records]
    assert (runs.number("nobody"), runs.place("zz")) == (None, None)


def test_a_sample_holds_small_stages_extremes_and_what_is_asked_for(runs):
    every = np.arange(N)
    assert runs.sample(every, most=N) is every
    some = runs.sample(every, most=26, among="y", always=(17,))
    assert len(some) <= 26
    assert set(range(50, 60)) | {40, 0, 17} <= set(some.tolist())
    design = runs.sample(every[:50], most=10)
    np.testing.assert_array_equal(design, np.linspace(0, 49, 10).astype(int))


def test_the_runs_of_a_robust_loop_are_named_and_counted_apart(stored):
    folder = CampaignFolder.opened(stored[0], documents=("design", "worst_case", "screening"))
    folder.documents["robust_layout"] = None
    assert "layouts" not in " ".join(runs_section(folder).sentences)
    folder.documents["robust_layout"] = {"runs": {"ok": 7780, "timeout": 5}}
    section = runs_section(folder)
    assert section.sentences[1] == (
        "The robust loop made 7785 further true runs, of layouts, kept in layouts.sqlite: 7780 gave a value; "
        "5 took too long and were stopped."
    )
    table = section.blocks[0]
    assert [column.name for column in table.columns] == ["stage", "failed", "ok", "queued", "timeout", "all"]
    assert table.rows[-1] == ("layouts of the robust loop", 0, 7780, 0, 5, 7785)
    assert table.rows[0][-2:] == (0, 50)
    assert section.numbers["of_layouts"] == {"ok": 7780, "timeout": 5}


def test_the_page_says_what_is_a_sample(stored, monkeypatch):
    folder = CampaignFolder.opened(stored[0], documents=("design", "worst_case", "screening"))
    assert "drawn and listed" not in str(runs_section(folder).blocks)
    monkeypatch.setattr(section_module, "MOST_SHOWN", 20)
    figures = {block.id: block for block in runs_section(folder).blocks if hasattr(block, "read_off")}
    shown = len(figures["responses"].table.rows)
    assert shown <= 20
    assert f"{shown} of 59 runs are drawn and listed: every so many of each stage" in (
        figures["responses"].read_off
    )
    assert "9 of 9 failed and 20 of 50 good runs are drawn" in figures["failures"].read_off


def test_runs_that_were_read_are_not_read_again(stored, monkeypatch):
    read = CampaignFolder.opened(stored[0], documents=()).runs

    def refused(*_, **__):
        raise AssertionError("the runs are known")

    monkeypatch.setattr("workbench.report.page.folder.run_chunks", refused)
    assert CampaignFolder.opened(stored[0], documents=(), runs=read).runs is read
    with pytest.raises(AssertionError, match="the runs are known"):
        CampaignFolder.opened(stored[0], documents=(), runs=RunList(model=("other", "1", "a")))

"""Exports: one pass over the runs, the netCDF that xarray would write, cells that nobody computes."""

import csv
import gc

import pytest

from workbench.campaign.rescue.stock import exported_rows
from workbench.campaign.results.exports import dataset, write_all
from workbench.errors import StoreError
from workbench.models.stored import run_chunks
from workbench.report.page.blocks import Column, Table
from workbench.report.page.markdown import csv_text
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign

WORDS = ["=1+1", "-x", "'tis", "steel", "steel"]
QUOTED = ["'=1+1", "'-x", "'tis", "steel", "steel"]
SPACE = Space(
    [Parameter("a", lower=-1, upper=1), Parameter("word", levels=tuple(WORDS[:4]), kind="categorical")]
)


def cells(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_texts_that_begin_a_formula_are_quoted(tmp_path):
    with Campaign.of(lambda a, word: a, SPACE, folder=tmp_path / "c") as campaign:
        for a, word in zip((-0.5, 0.5, 0.25, 0.0), WORDS[:4], strict=True):
            campaign.tell(None, a, parameters={"a": a, "word": word})
        campaign.tell(None, failure="@SUM(A1) is no number", parameters={"a": 1.0, "word": "steel"})
        write_all(campaign, folder=tmp_path)
        rows = cells(tmp_path / "runs.csv")
        assert [row["word"] for row in rows] == QUOTED
        assert rows[0]["a"] == "-0.5", "a number is a number"
        assert rows[-1]["error"] == "'@SUM(A1) is no number"
        saved = exported_rows(tmp_path, SPACE, ["y"], model=campaign.spec.identity, version="1")
        assert [dict(row.inputs)["word"] for row in saved] == WORDS
        assert saved[-1].error == "@SUM(A1) is no number"
        write_all(campaign, folder=tmp_path, raw=True)
        assert [row["word"] for row in cells(tmp_path / "runs.csv")] == WORDS


def told(folder, count):
    """A campaign with a word of two bytes, a failure that has no value, and another space's run."""
    campaign = Campaign.of(lambda a, word: a, SPACE, folder=folder)
    for k in range(count):
        campaign.tell(None, 0.1 * k, parameters={"a": 0.01 * k, "word": WORDS[k % 4]})
    if count:
        campaign.tell(None, failure="größer", parameters={"a": 1.0, "word": "steel"})
    return campaign


@pytest.mark.parametrize("count", [0, 7])
def test_the_netcdf_is_that_of_xarray(tmp_path, monkeypatch, count):
    monkeypatch.setattr(run_chunks, "AT_ONCE", 3)
    with told(tmp_path / "c", count) as campaign:
        write_all(campaign, folder=tmp_path)
        study = campaign.study
        data = dataset(campaign.runs(), study.space, study.responses, name=study.name)
    whole = bytes(data.to_netcdf(None, format="NETCDF3_64BIT", engine="scipy"))
    assert (tmp_path / "results.nc").read_bytes() == whole


def test_what_passes_in_pieces_is_the_same(tmp_path, monkeypatch):
    with told(tmp_path / "c", 7) as campaign:
        first = [path.read_bytes() for path in write_all(campaign, folder=tmp_path)]
        monkeypatch.setattr(run_chunks, "AT_ONCE", 1)
        seen = []
        paths = write_all(campaign, folder=tmp_path, beside=seen.append)
        assert [path.read_bytes() for path in paths] == first
        assert [key for chunk in seen for key in chunk.keys] == [run.key for run in campaign.runs()]
    assert first[0].count(b"\n") == 9


def test_who_stops_reading_in_the_middle_leaves_the_collector_on(tmp_path):
    with told(tmp_path / "c", 7) as campaign:
        chunks = campaign.store.chunks(
            model=campaign.spec.identity, version=campaign.spec.version, names=campaign.study.space.names
        )
        assert gc.isenabled()
        next(chunks)
        assert gc.isenabled()
        chunks.close()
    assert gc.isenabled()


def test_a_damaged_run_leaves_the_former_exports(tmp_path):
    with told(tmp_path / "c", 7) as campaign:
        before = [path.read_bytes() for path in write_all(campaign, folder=tmp_path)]
        db = campaign.store._db
        db.execute("DROP TRIGGER evaluation_changed")
        db.execute("UPDATE evaluation SET version = 'other' WHERE id = 5")
        with pytest.raises(StoreError, match=r"is damaged: run 5 \(.*is not as it was stored"):
            write_all(campaign, folder=tmp_path)
    assert [(tmp_path / name).read_bytes() for name in ("runs.csv", "results.nc")] == before
    assert not list(tmp_path.glob(".*.new"))


def test_tables_of_the_report_are_quoted_too():
    table = Table(id="t", title="t", columns=[Column(name="name"), Column(name="y")], rows=[("=cmd()", -1.5)])
    assert csv_text(table).splitlines()[1] == "'=cmd(),-1.5"

"""Histories of many runs: over common times, read in pieces, as a Dataset and as netCDF."""

import re

import numpy as np
import pytest
import xarray as xr

from workbench.campaign.results.exports import write_all
from workbench.errors import StudyError
from workbench.histories import stack as stack_module
from workbench.histories.netcdf import write_histories
from workbench.histories.stack import stacked
from workbench.histories.store import HistoryStore
from workbench.models.histories import History
from workbench.stages.campaign import Campaign

T = np.linspace(0, 2, 1300)
KEYS = [f"{k:032x}" for k in range(9)]


def row(k, t=T):
    return np.sin(k + 3 * t)


def made(folder, times, name="x"):
    with HistoryStore.opened(folder) as store:
        store.write((KEYS[k], {name: (History(t, row(k, t)), "m")}) for k, t in enumerate(times))
    return folder


@pytest.fixture
def same(tmp_path):
    return made(tmp_path, [T] * 9)


def test_runs_on_the_same_times_are_read_as_they_are(same, monkeypatch):
    whole = np.array([row(k) for k in (2, 0, 8)])
    found = stacked(same, "x", [KEYS[2], "unknown", KEYS[0], KEYS[8]])
    assert (found.shape, found.left_out, found.unit, found.interpolated) == ((3, 1300), 1, "m", False)
    assert found.keys == [KEYS[2], KEYS[0], KEYS[8]]
    assert found.values([2, 0], [1299, 5, 600]).tolist() == whole[[2, 0]][:, [1299, 5, 600]].tolist()
    assert found.values([], [1]).shape == (0, 1)
    for size in (1, 1500, 10**9):
        monkeypatch.setattr(stack_module, "BLOCK", size)
        samples = np.arange(0, 1300, 7)
        blocks = list(found.by_times(range(3), samples))
        assert np.hstack(blocks).tolist() == whole[:, samples].tolist()
        assert len(blocks) == (1 if size > 1e6 else 3), "no part is read twice"


def test_runs_that_ended_early_are_filled_up_with_nan(tmp_path):
    found = stacked(made(tmp_path, [T, T[:700], T[:0], T[:1]]), "x", KEYS[:4])
    expected = np.full((4, 1300), np.nan)
    for k, n in enumerate((1300, 700, 0, 1)):
        expected[k, :n] = row(k)[:n]
    np.testing.assert_array_equal(found.values(range(4), range(1300)), expected)


def test_runs_on_other_times_need_times(tmp_path):
    made(tmp_path, [T, np.linspace(0, 1.9, 500), np.linspace(-0.1, 2, 40)])
    words = (
        "the histories 'x' of 3 runs stand on 3 different rows of times, of 40 to 1300 samples; all cover "
        "0 to 1.9. Give the times you want, such as time=numpy.linspace(0, 1.9, 1300)"
    )
    with pytest.raises(StudyError, match=re.escape(words)):
        stacked(tmp_path, "x", KEYS)
    times = np.array([-0.2, -0.05, 0.0, 0.7, 1.9, 1.95, 2.0, 2.5])
    found = stacked(tmp_path, "x", KEYS, times=times)
    assert found.interpolated
    for some in (np.arange(8), np.array([6, 3, 4]), np.array([0]), np.array([7])):
        expected = [
            np.interp(times[some], t, row(k, t), left=np.nan, right=np.nan)
            for k, t in enumerate((T, np.linspace(0, 1.9, 500), np.linspace(-0.1, 2, 40)))
        ]
        np.testing.assert_allclose(found.values(range(3), some), expected, rtol=1e-15)
    with pytest.raises(StudyError, match=r"times need to be a row of rising numbers, such as numpy.linspace"):
        stacked(tmp_path, "x", KEYS, times=times[::-1])
    made(tmp_path, [T[:0]])
    assert np.isnan(stacked(tmp_path, "x", KEYS[:1], times=times).values([0], [0, 4])).all()


def test_what_is_not_there_is_said(tmp_path, same):
    with pytest.raises(StudyError, match=r"no run in .* has a time history 'v'; there are: x"):
        stacked(same, "v", KEYS)
    (tmp_path / "none").mkdir()
    for ask in (lambda f: stacked(f, "x", KEYS), lambda f: write_histories(f / "h.nc", f, KEYS)):
        with pytest.raises(StudyError, match=r"none has no time histories; responses with `reduce` have"):
            ask(tmp_path / "none")
    with pytest.raises(StudyError, match=r"none of the 1 runs in .* has a time history"):
        write_histories(tmp_path / "h.nc", same, ["unknown"])


STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
unit = "kg"
lower = 0
upper = 1
[[parameter]]
name = "time"
lower = 0
upper = 1
[[response]]
name = "x"
unit = "m"
reduce = "max"
[[response]]
name = "v"
unit = "m/s"
reduce = "final"
[evaluate]
engine = "inline"
"""
CODE = """
import numpy as np
def f(a, time):
    if a > 0.9:
        raise ValueError("too heavy")
    t = np.linspace(0, 1, 2000)
    n = 2000 if a < 0.5 else 900
    return {"x": (t, a * t), "v": (t[:n], np.sin(a * t[:n]))}
"""


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "m.py").write_text(CODE)
    (tmp_path / "s.toml").write_text(STUDY)
    with Campaign.from_file(tmp_path / "s.toml") as found:
        found.evaluate([{"a": a, "time": 0.5} for a in (0.25, 0.75, 1.0, 0.125)])
        yield found


def test_a_campaign_gives_a_lazy_dataset(campaign, monkeypatch):
    data = campaign.histories("x")
    assert dict(data.sizes) == {"run": 3, "time": 2000}
    assert data["a"].values.tolist() == [0.25, 0.75, 0.125]
    assert (data["x"].attrs["units"], data["a"].attrs["units"]) == ("m", "kg")
    assert data["x"].sel(time=0.5, method="nearest").shape == (3,)
    heavy = data["x"].where(data["a"] > 0.2, drop=True)
    assert heavy.isel(time=-1).values.tolist() == [0.25, 0.75]
    last = data["x"].isel(run=[2, 0], time=[1999, 0])
    assert last.values.tolist() == [[0.125, 0], [0.25, 0]]
    assert float(data["x"].isel(run=0, time=-1)) == 0.25
    v = campaign.histories("v")["v"]
    assert v.isnull().sum("time").values.tolist() == [0, 1100, 0]
    assert campaign.histories("v", time=[0.1, 0.9])["v"].isnull().sum("time").values.tolist() == [0, 1, 0]
    read = []
    parts = HistoryStore._parts
    monkeypatch.setattr(HistoryStore, "_parts", lambda *a: read.append(a[2]) or parts(*a))
    lazy = campaign.histories("x")
    assert read == []
    lazy["x"].isel(time=1500).load()
    assert read == [1500 // 512], "one part of each run"


def test_histories_go_into_one_netcdf_file(campaign, tmp_path):
    path = write_all(campaign, folder=tmp_path, histories=True)[-1]
    assert path.name == "histories.nc"
    keys = [row.key for row in campaign.runs() if row.status == "ok"]
    with xr.open_dataset(path, engine="scipy") as data:
        assert [key.decode() for key in data["run"].values] == keys
        np.testing.assert_array_equal(data["x"].values, campaign.histories("x")["x"].values)
        np.testing.assert_array_equal(data["time_x"].values, np.linspace(0, 1, 2000))
        assert data["x"].attrs["units"] == "m"
        assert data["x"].dims == ("run", "time_x")
        assert data["v"].dims == data["time_v"].dims == ("run", "sample_v")
        np.testing.assert_array_equal(data["v"].values, campaign.histories("v")["v"].values)
        assert np.isnan(data["time_v"].values[1, 900:]).all()
        assert data["time_v"].values[1, :900].tolist() == np.linspace(0, 1, 2000)[:900].tolist()


def test_a_run_without_one_of_the_histories_has_nan_there(same, tmp_path):
    with HistoryStore.opened(same) as store:
        store.write([("z" * 32, {"v": (History([0, 1], [5, 6]), "m/s")})])
    assert write_histories(tmp_path / "h.nc", same, [*KEYS[:2], "z" * 32, "unknown"]) == 3
    with xr.open_dataset(tmp_path / "h.nc", engine="scipy") as data:
        assert data["v"].values[2].tolist() == [5, 6]
        assert np.isnan(data["v"].values[:2]).all()
        assert np.isnan(data["x"].values[2]).all()
        assert data["x"].values[1].tolist() == row(1).tolist()

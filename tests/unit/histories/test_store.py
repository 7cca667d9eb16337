"""The database of histories: what is written is read, in parts, beside the writer, and damage is told."""

import sqlite3

import numpy as np
import pytest
from scipy.io import netcdf_file

from workbench.campaign.rescue.examination import examined_histories
from workbench.errors import StoreError
from workbench.histories.store import FILE, HistoryStore
from workbench.histories.stored import copy_histories, history_dataset, take_former
from workbench.models.histories import History

T = np.linspace(0, 2, 1300)


def runs_of(count, n=1300):
    return [
        (
            f"run{k}",
            {"x": (History(T[:n], np.sin(k + 3 * T[:n])), "m"), "f": (History(T[:n], k * T[:n]), "N")},
        )
        for k in range(count)
    ]


@pytest.fixture
def folder(tmp_path):
    with HistoryStore.opened(tmp_path) as store:
        store.write(runs_of(12))
    return tmp_path


def test_what_is_written_is_read(folder):
    with HistoryStore.reading(folder) as store:
        assert store.names() == {"f": 12, "x": 12}
        entries = store.entries(name="x")
        assert [e.key for e in entries] == [f"run{k}" for k in range(12)]
        assert (entries[3].unit, entries[3].samples, entries[3].first, entries[3].last) == (
            "m",
            1300,
            0.0,
            2.0,
        )
        assert store.history(entries[3]) == History(T, np.sin(3 + 3 * T))
        whole = np.array([np.sin(k + 3 * T) for k in range(12)])
        for begin, end in ((0, 1300), (700, 701), (511, 513), (1299, 1300), (5, 5)):
            assert store.values(entries[2:9], begin, end).tobytes() == whole[2:9, begin:end].tobytes()
        assert store.values([], 0, 3).shape == (0, 3)
        assert store.wrong() == []


def test_equal_times_are_stored_once(folder):
    with HistoryStore.opened(folder) as store:
        store.write([("late", {"x": (History(T[:700], T[:700]), "m"), "none": (History([], []), "1")})])
        assert len({e.axis for e in store.entries(name="x")}) == 2
        assert len({e.axis for e in store.entries()}) == 3
        assert store.history(store.entries(name="none")[0]) == History([], [])
        longer, shorter = store.values(store.entries(name="x")[-2:], 600, 700)
        assert shorter.tolist() == T[600:700].tolist()
        assert longer.tolist() == np.sin(11 + 3 * T[600:700]).tolist()


def test_histories_of_a_run_are_replaced(folder):
    with HistoryStore.opened(folder) as store:
        store.write([("run3", {"x": (History([0, 1], [5, 6]), "mm")})])
        (entry,) = store.entries(key="run3")
        assert (entry.name, entry.unit, store.history(entry)) == ("x", "mm", History([0, 1], [5, 6]))
        assert store.wrong() == []
    db = sqlite3.connect(folder / FILE)
    assert db.execute("SELECT COUNT(*) FROM part").fetchone() == (11 * 2 * 3 + 1,)
    db.close()


def test_what_does_not_fit_writes_nothing(folder, monkeypatch):
    with HistoryStore.opened(folder) as store:
        wrong = ("b", {"x": (History([0, 1], [1]), "m")})
        with pytest.raises(
            StoreError, match="history 'x' of run b has 2 times and 1 values; as many of both"
        ):
            store.write([("a", {"x": (History([0, 7], [1, 2]), "m")}), wrong])
        assert store.entries(key="a") == []
        store.write([("a", {"x": (History([0, 7], [1, 2]), "m")})])  # its axis is stored after all
        assert store.history(store.entries(key="a")[0]) == History([0, 7], [1, 2])


def test_it_is_read_beside_its_writer(folder):
    with HistoryStore.opened(folder) as store:
        store.write([("new", {"x": (History(T, T), "m")})])
        with HistoryStore.reading(folder) as other:
            assert other.history(other.entries(key="new")[0]) == History(T, T)
    assert [p.name for p in folder.iterdir()] == [FILE]


def test_there_may_be_none(tmp_path):
    assert HistoryStore.reading(tmp_path) is None
    (tmp_path / FILE).touch()
    assert HistoryStore.reading(tmp_path) is None
    assert examined_histories(tmp_path) is None
    with pytest.raises(StoreError, match="run a has no time histories in "):
        history_dataset(tmp_path, "a")


def change(folder, statement, *values):
    db = sqlite3.connect(folder / FILE)
    db.execute(statement, values)
    db.commit()
    db.close()


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("DELETE FROM part WHERE id = 1 << 20", r"part 0 of 'x' of run run0 is missing"),
        (
            "UPDATE part SET content = (SELECT content FROM part WHERE id = 3 << 20) WHERE id = 1 << 20",
            "part 0 of 'x' of run run0: part 0 is another one: it stands in the wrong place",
        ),
        ("UPDATE part SET content = x'00ff' WHERE id = 1 << 20", "part 0 is not as it was stored"),
        ("UPDATE history SET name = 'y' WHERE id = 1", "stands in the wrong place"),
        (
            "UPDATE axis SET digest = x'00'",
            r"is damaged: axis 1: its times have another digest. Responses keep their values",
        ),
    ],
)
def test_damage_is_told(folder, statement, words):
    assert examined_histories(folder).lines()[1] == "ok   histories   as they were stored: 12 of f, 12 of x"
    change(folder, statement)
    with HistoryStore.reading(folder) as store, pytest.raises(StoreError, match=words):
        store.history(store.entries(key="run0")[0])
    found = examined_histories(folder)
    assert not found.is_sound
    assert "BAD  histories " in found.lines()[1]


def test_a_newer_or_another_file_is_refused(folder):
    change(folder, "PRAGMA user_version = 9")
    for opened in (HistoryStore.opened, HistoryStore.reading):
        with pytest.raises(StoreError, match="has schema 9, this holdfast knows up to 1; update holdfast"):
            opened(folder)
    (folder / FILE).write_bytes(b"no database at all" * 100)
    for opened in (HistoryStore.opened, HistoryStore.reading):
        with pytest.raises(StoreError, match="is damaged"):
            opened(folder)
    assert "is damaged" in " ".join(examined_histories(folder).lines()[1:])


def test_files_of_older_campaigns_are_read_and_copied(tmp_path):
    old = tmp_path / "old"
    (old / "histories").mkdir(parents=True)
    with netcdf_file(old / "histories" / "abc.nc", "w") as file:
        file.createDimension("time_x", len(T))
        for name, row in (("time_x", T), ("x", T**2)):
            file.createVariable(name, "f8", ("time_x",))[:] = row
        file.variables["x"].units = b"m"
    data = history_dataset(old, "abc")
    assert data["x"].attrs["units"] == "m"
    np.testing.assert_array_equal(data["x"].values, T**2)
    np.testing.assert_array_equal(data["time_x"].values, T)
    new = tmp_path / "new"
    new.mkdir()
    copy_histories(old, new, [("abc", "def"), ("gone", "gone")])
    assert history_dataset(new, "def").identical(data)
    assert not (new / "histories").exists()
    (old / "histories" / "bad.nc").write_bytes(b"nothing")
    with pytest.raises(StoreError, match="run bad has no time histories"):
        history_dataset(old, "bad")
    assert take_former(old) == 1
    assert [p.name for p in (old / "histories").iterdir()] == ["bad.nc"], "what cannot be read stays"
    assert history_dataset(old, "abc").identical(data)
    assert take_former(old) == 0
    (old / "histories" / "bad.nc").unlink()
    (old / "histories").rmdir()
    assert take_former(old) == 0

"""A store of an older version opens after a migration, keeps a copy, and loses nothing."""

import json
import sqlite3
from pathlib import Path

import pytest

from workbench.campaign import store_schema
from workbench.campaign.integrity.checksums import CHECKED, is_sound
from workbench.campaign.store import Store, run_key
from workbench.campaign.store_schema import VERSION
from workbench.errors import StoreError
from workbench.models.protocol import Answer

HERE = Path(__file__).parent


def written_by(version, folder):
    """The database that a version wrote."""
    path = folder / "runs.sqlite"
    db = sqlite3.connect(path)
    db.executescript((HERE / f"store_v{version}.sql").read_text())
    db.close()
    return path


@pytest.fixture
def old(tmp_path):
    """The database of the first version."""
    return written_by(1, tmp_path)


def dump(path):
    db = sqlite3.connect(path)
    rows = db.execute(
        "SELECT key, inputs, outputs, error, created, finished FROM evaluation ORDER BY id"
    ).fetchall()
    version = db.execute("PRAGMA user_version").fetchone()[0]
    db.close()
    return version, rows


def test_version_1_is_brought_up(old):
    version, before = dump(old)
    assert version == 1
    store = Store.opened(old)
    rows = store.rows()
    assert [row.status for row in rows] == [
        "ok",
        "nonfinite",
        "ok",
        "queued",
        "killed",
    ]  # the 4th was running
    store.finish(rows[0].key, Answer(status="ok", outputs={"y": 9.0}), attempt=2)
    assert store.attempts(rows[0].key) == [(2, "ok", "late", "")]
    assert store.check() == []
    store.close()
    assert dump(old) == (VERSION, before)
    assert dump(old.with_name("runs.sqlite.v1.backup")) == (1, before)
    Store.opened(old).close()  # and once more, without another migration


@pytest.mark.parametrize("version", range(1, VERSION))
def test_a_new_and_a_migrated_store_have_the_same_tables(version, tmp_path):
    old = written_by(version, tmp_path)
    Store.opened(old).close()
    Store.opened(tmp_path / "new.sqlite").close()

    def tables(path):
        db = sqlite3.connect(path)
        rows = db.execute(
            "SELECT type, name, sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY name"
        ).fetchall()
        db.close()
        return rows

    assert tables(old) == tables(tmp_path / "new.sqlite")


def test_version_2_gains_a_place_for_gradients(tmp_path):
    path = written_by(2, tmp_path)
    reading = Store.reading(path)
    assert all(row.gradients == {} for row in reading.rows())
    reading.close()
    store = Store.opened(path)
    first, *_, waiting, _ = store.rows()
    assert store.attempts(first.key) == [(2, "ok", "late", "")]
    slopes = {"y": {"a": 1.0, "b": -2.0}}
    store.finish(waiting.key, Answer(status="ok", outputs={"y": 1.0}, gradients=slopes), attempt=2)
    assert store.rows(keys=[waiting.key])[0].gradients == slopes
    assert store.rows(keys=[first.key])[0].gradients == {}
    store.close()


def test_version_3_parts_simulations_from_their_reading(tmp_path):
    path = written_by(3, tmp_path)
    store = Store.opened(path)
    rows = store.rows()
    assert [(row.status, row.inputs["a"]) for row in rows] == [
        ("ok", 0.75),
        ("failed", 0.95),
        ("ok", 0.25),  # of two that were read in two ways the later
        ("queued", 0.5),
    ]
    assert rows[2].outputs == {"force": -7.0, "end": 0.75}
    assert [a[2] for a in store.attempts(rows[2].key)] == ["other reading"]
    ((model,),) = store.select("SELECT DISTINCT model FROM evaluation")
    assert all(row.key == run_key(model, "1", row.inputs) for row in rows)
    former = [key for (key,) in store.select("SELECT former FROM evaluation ORDER BY id")]
    assert former[1] == "68d0763dec0e2e1b3697598a9fda8b12"
    ((kept,),) = store.select("SELECT kept FROM evaluation WHERE key = ?", [rows[2].key])
    assert sorted(json.loads(kept).values()) == [-7.0, 0.0, 0.75], "what was read from either twin"
    store.close()


def test_version_4_gains_checksums(tmp_path):
    path = written_by(4, tmp_path)
    reading = Store.reading(path)
    assert [row.status for row in reading.rows()] == ["ok", "queued", "nonfinite", "queued"]
    reading.close()
    store = Store.opened(path)
    first = store.rows()[0]
    assert (first.outputs, first.gradients) == ({"y": 1 / 3}, {"y": {"a": 1.0, "b": 0.5}})
    assert [a[2] for a in store.attempts(store.rows()[1].key)] == ["retried"]
    for table in CHECKED:
        assert store.select(f"SELECT COUNT(*) FROM {table} WHERE NOT ({is_sound(table)})") == [(0,)]
        assert store.select(f"SELECT COUNT(*) FROM {table} WHERE checksum IS NULL") == [(0,)]
    store.close()


def test_a_migration_that_fails_leaves_the_old_database(tmp_path, monkeypatch):
    path = written_by(3, tmp_path)
    before = dump(path)

    def fails(db):
        db.execute("DELETE FROM evaluation")
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setitem(store_schema.ROWS, 3, fails)
    with pytest.raises(StoreError, match="disk I/O error"):
        Store.opened(path)
    assert dump(path) == before


def test_every_version_has_its_step():
    assert sorted(store_schema.MIGRATIONS) == list(range(1, VERSION))


def test_readers_do_not_migrate(old):
    store = Store.reading(old)
    assert len(store.rows()) == 5
    store.close()
    assert dump(old)[0] == 1


def test_no_copy_no_migration(old, monkeypatch):
    before = dump(old)

    class Full:
        @staticmethod
        def connect(path):
            raise sqlite3.OperationalError("disk full")

    monkeypatch.setattr(
        store_schema, "sqlite3", type("sql", (), {"connect": Full.connect, "Error": sqlite3.Error})
    )
    with pytest.raises(StoreError, match=r"cannot keep a copy of .*runs.sqlite before bringing it to schema"):
        Store.opened(old)
    assert dump(old) == before

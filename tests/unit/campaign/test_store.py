"""The database of a campaign: keys, statuses, order, leases, locks, what a broken one says."""

import json
import math
import sqlite3

import pytest

from workbench.campaign import store as module
from workbench.campaign.store import Store, run_key
from workbench.errors import StoreError
from workbench.models.protocol import Answer
from workbench.system.database import file_system
from workbench.system.lease import is_alive, owner_of_this_process


def queue(store, *rows, batch="design"):
    keys = [run_key("m", "1", row) for row in rows]
    store.enqueue(zip(keys, rows, strict=True), batch=batch, model="m", version="1", seed=7)
    return keys


@pytest.fixture
def store(tmp_path):
    store = Store.opened(tmp_path / "runs.sqlite")
    yield store
    store.close()


def test_keys_follow_model_version_and_inputs():
    row = {"a": 0.1, "b": 2}
    key = run_key("m", "1", row)
    assert key == run_key("m", "1", {"b": 2, "a": 0.1})
    assert (
        len({key, run_key("n", "1", row), run_key("m", "2", row), run_key("m", "1", {"a": 0.1, "b": 3})}) == 4
    )
    assert run_key("m", "1", {"a": math.nextafter(0.1, 1)}) != run_key("m", "1", {"a": 0.1})


def test_rows_keep_order_and_full_precision(store):
    values = [{"a": 1 / 3}, {"a": 5e-324}, {"a": 1e308}]
    keys = queue(store, *values)
    assert queue(store, values[1], {"a": 9.0})[0] == keys[1]  # known already
    store.start([(keys[2], 1)])
    store.finish(
        keys[2], Answer(status="ok", outputs={"y": 0.1 + 0.2}, wall=2.0, cpu=1.0), attempt=1, host="h"
    )
    rows = store.rows()
    assert [row.inputs for row in rows] == [*values, {"a": 9.0}]
    assert [row.status for row in rows] == ["queued", "queued", "ok", "queued"]
    assert rows[2].outputs == {"y": 0.1 + 0.2}
    assert (rows[2].wall, rows[2].cpu, rows[2].host, rows[2].seed, rows[2].attempt) == (2.0, 1.0, "h", 7, 1)
    assert [row.key for row in store.rows(keys=[keys[2], "unknown", keys[0]])] == [keys[2], keys[0]]
    assert store.counts() == {"ok": 1, "queued": 3}
    assert store.check() == []


def test_the_text_of_answers_is_that_of_their_records(store):
    keys = queue(store, *({"a": float(k)} for k in range(6)))
    queue(store, {"a": 7.0}, batch="told")
    ends = [
        Answer(status="ok", outputs={"µ [1]": 1 / 3, "y": -5e-324}),
        Answer(status="failed", error="it broke"),
        Answer(status="skipped"),
        Answer(status="ok", outputs={"y": 1e308}),
    ]
    for key, answer in zip(keys, ends, strict=False):
        store.finish(key, answer, attempt=1)
    store.start([(keys[4], 1)])

    def expected(keys):
        rows = [row for row in store.rows(keys=keys) if row.status not in ("queued", "running")]
        return json.dumps([[row.key, row.status, row.outputs] for row in rows])[1:-1]

    for wanted in (keys, [keys[3], "unknown", *keys[:3]], keys[2:4], keys[4:], ["unknown"], []):
        assert store.answers_as_text(wanted) == expected(wanted)
    before = store.answers_as_text(keys)
    store.write("UPDATE evaluation SET outputs = '{\"y\": 2' WHERE key = ?", [keys[3]])  # no JSON any more
    assert store.answers_as_text(keys) == before.replace('{"y": 1e+308}', '{"y": 2')


@pytest.mark.parametrize(("stretch", "many"), [(2, 100), (3, 0), (100, 0), (100, 100)])
def test_statuses_come_in_the_order_of_their_keys(store, monkeypatch, stretch, many):
    keys = queue(store, *({"a": float(k)} for k in range(4)))
    (other,) = queue(store, {"a": 9.0}, batch="worst_case")
    keys += queue(store, *({"a": float(k)} for k in range(4, 8)))
    for key, status in zip(keys, ("ok", "failed", "ok"), strict=False):
        store.finish(key, Answer(status=status, outputs={"y": 1.0} if status == "ok" else {}), attempt=1)
    monkeypatch.setattr(module, "STRETCH", stretch)
    monkeypatch.setattr(module, "MANY", many)
    expected = dict(zip(keys, ["ok", "failed", "ok", *["queued"] * 5], strict=True))
    orders = (
        keys,
        keys[::-1],
        [*keys, *keys[:3]],
        [keys[2], "unknown", other, *keys],
        keys[:4],
        ["unknown"],
        [],
    )
    for wanted in orders:
        right = {key: {**expected, other: "queued"}[key] for key in wanted if key != "unknown"}
        assert list(store.statuses(wanted).items()) == list(right.items())


def test_an_answer_is_given_once(store):
    (key,) = queue(store, {"a": 1.0})
    store.finish(key, Answer(status="ok", outputs={"y": 1.0}), attempt=1)
    store.finish(key, Answer(status="ok", outputs={"y": 2.0}), attempt=2)
    assert store.rows()[0].outputs == {"y": 1.0}


def test_failed_rows_may_be_tried_again(store):
    keys = queue(store, {"a": 1.0}, {"a": 2.0})
    store.finish(keys[0], Answer(status="failed", error="bad\0\ud800"), attempt=1)
    store.finish(keys[1], Answer(status="ok", outputs={"y": 2.0}), attempt=1)
    assert store.rows()[0].error == "bad\\0\\ud800"
    store.retry(keys)
    assert [(row.status, row.attempt) for row in store.rows()] == [("queued", 0), ("ok", 1)]


def test_a_transaction_is_all_or_nothing(store):
    (key,) = queue(store, {"a": 1.0})

    def half_done():
        with store.transaction():
            store.finish(key, Answer(status="ok", outputs={"y": 1.0}), attempt=1)
            queue(store, {"a": 2.0})
            raise RuntimeError("between two writes")

    with pytest.raises(RuntimeError, match="between"):
        half_done()
    assert [row.status for row in store.rows()] == ["queued"]


def test_a_row_of_a_dead_owner_returns_to_the_queue(tmp_path):
    path = tmp_path / "runs.sqlite"
    store = Store.opened(path)
    keys = queue(store, {"a": 1.0}, {"a": 2.0}, {"a": 3.0})
    store.start([(key, 1) for key in keys])
    gone = ["nonsense", owner_of_this_process().replace("|", "|x", 1)]
    for key, owner in zip(keys, gone, strict=False):
        store._db.execute("UPDATE evaluation SET owner = ? WHERE key = ?", (owner, key))
    store.close()
    store = Store.opened(path)
    assert [row.status for row in store.rows()] == ["queued", "queued", "running"]
    assert [row.attempt for row in store.rows()] == [1, 1, 1]
    store.close()


def test_leases_tell_a_reused_process_id_apart():
    own = owner_of_this_process()
    assert is_alive(own)
    host, boot, pid, start = own.split("|")
    assert not is_alive("|".join((host, boot, pid, str(int(start) + 1))))
    assert not is_alive("|".join((host, "another boot", pid, start)))
    assert not is_alive("|".join(("another host", boot, pid, start)))


def test_one_coordinator_at_a_time_and_many_readers(store, tmp_path):
    queue(store, {"a": 1.0})
    with pytest.raises(StoreError, match="is in use by another holdfast"):
        Store.opened(tmp_path / "runs.sqlite")
    reader = Store.reading(tmp_path / "runs.sqlite")
    assert len(reader.rows()) == 1
    with pytest.raises(StoreError, match=r"readonly|read-only"):
        queue(reader, {"a": 2.0})
    reader.close()


def test_databases_that_are_not_ours(tmp_path):
    (tmp_path / "noise.sqlite").write_bytes(b"x" * 5000)
    with pytest.raises(StoreError, match="file is not a database"):
        Store.opened(tmp_path / "noise.sqlite")
    sqlite3.connect(tmp_path / "other.sqlite").execute("CREATE TABLE t (a)").connection.close()
    with pytest.raises(StoreError, match="not one of holdfast's"):
        Store.opened(tmp_path / "other.sqlite")
    store = Store.opened(tmp_path / "runs.sqlite")
    store._db.execute("PRAGMA user_version = 99")
    store.close()
    with pytest.raises(StoreError, match="has schema 99, this holdfast knows up to"):
        Store.opened(tmp_path / "runs.sqlite")
    with pytest.raises(StoreError, match="no database"):
        Store.reading(tmp_path / "gone.sqlite")
    with pytest.raises(StoreError, match="cannot write in"):
        Store.opened(tmp_path / "no" / "folder" / "runs.sqlite")


def test_a_database_that_is_refused_is_not_left_open(tmp_path, monkeypatch):
    (tmp_path / "noise.sqlite").write_bytes(b"x" * 5000)
    held = []
    connect = sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", lambda *a, **k: held.append(connect(*a, **k)) or held[-1])
    for way in (Store.opened, Store.reading):
        with pytest.raises(StoreError, match="file is not a database"):
            way(tmp_path / "noise.sqlite")
    for db in held:
        with pytest.raises(sqlite3.ProgrammingError, match="closed"):
            db.execute("SELECT 1")
    assert len(held) == 2


@pytest.mark.parametrize(("kind", "journal"), [("ext4", "wal"), ("nfs4", "truncate"), ("lustre", "truncate")])
def test_the_journal_fits_the_file_system(tmp_path, monkeypatch, kind, journal):
    monkeypatch.setattr(module, "file_system", lambda folder: kind)
    store = Store.opened(tmp_path / "runs.sqlite")
    assert store._db.execute("PRAGMA journal_mode").fetchone() == (journal,)
    assert store._db.execute("PRAGMA synchronous").fetchone() == (2,)  # FULL
    store.close()


def test_the_file_system_is_known(tmp_path):
    assert file_system(tmp_path) != ""


def test_the_schema_is_readable_without_us(store, tmp_path):
    (key,) = queue(store, {"a": 0.5})
    store.finish(key, Answer(status="ok", outputs={"y": 0.25}), attempt=1)
    plain = sqlite3.connect(f"file:{tmp_path / 'runs.sqlite'}?mode=ro", uri=True)
    query = "SELECT json_extract(inputs, '$.a'), json_extract(outputs, '$.y') FROM evaluation"
    assert plain.execute(query).fetchall() == [(0.5, 0.25)]
    assert json.loads(plain.execute("SELECT inputs FROM evaluation").fetchone()[0]) == {"a": 0.5}
    plain.close()

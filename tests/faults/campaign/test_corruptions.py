"""A damaged store is noticed, what can be read is saved, and nothing is said that is not so."""

import random
import shutil
import sqlite3

import pytest

from tests.faults.campaign.corruption import (
    KINDS,
    OF_A_LOG,
    OpenStore,
    closed_campaign,
    damage,
    killed_campaign,
    readable,
    stored_bytes,
    truth,
)
from tests.faults.seeds import SHIFT
from workbench.campaign.rescue.examination import examined
from workbench.campaign.rescue.recovery import recovered, recovery_lines
from workbench.campaign.results.exports import write_all
from workbench.campaign.store import Store
from workbench.campaign.view import CampaignView
from workbench.errors import HoldfastError, StoreError
from workbench.report.writing import report_numbers
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study
from workbench.system.witness import witness_says

RUNS = 48
SHARE = 0.95  # of the readable rows that are saved, over all corruptions


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A closed campaign, one with its last answers in the log, and the true answers."""
    folder = closed_campaign(tmp_path_factory.mktemp("sound") / "closed", runs=RUNS)
    answers = truth(folder)
    killed = killed_campaign(folder.with_name("killed"), folder, answered=12)
    assert len(answers) == RUNS
    return folder, killed, answers


def values_in(folder):
    """The answers that the store gives; None when it refuses."""
    try:
        with CampaignView.opened(load_study(folder / "s.toml")) as view:
            return {row.key: row.outputs["y"] for row in view.runs() if row.status == "ok"}
    except StoreError:
        return None


def corrupted_and_recovered(sound, place, kind, seed):
    """Readable rows, and how many of them were saved, of one corruption; everything else is asserted."""
    closed, killed, answers = sound
    folder = place / f"{kind}-{seed}".replace(" ", "-")
    shutil.copytree(killed if kind in OF_A_LOG else closed, folder)
    rows = stored_bytes(folder)
    damage(folder, kind, random.Random(seed))
    path = folder / "s.holdfast" / "runs.sqlite"
    left = readable(folder, rows)
    state = examined(path)
    shown = values_in(folder)
    if kind in OF_A_LOG:
        assert not state.is_sound or shown == answers, f"{kind} {seed} was not noticed"
    else:
        assert not state.is_sound, f"{kind} {seed} was not noticed"
    assert shown is None or all(answers[key] == y for key, y in shown.items()), "a false value was shown"
    if shown is not None and shown != answers:
        assert not state.is_sound
        with pytest.raises(StoreError, match=r"lacks answers that were stored|is damaged"):
            Campaign.from_file(folder / "s.toml").close()
    (found,) = recovered(load_study(folder / "s.toml"), folder / "s.holdfast")
    after = values_in(folder)
    assert all(answers[key] == y for key, y in after.items()), "a false value was saved"
    lost = answers.keys() - after.keys()
    said = "\n".join(recovery_lines([found]))
    assert found.saved == len(after)
    assert found.missing == (len(lost) if found.aside else 0)
    assert not lost or f"{len(lost)} runs of the design have no answer" in said
    assert found.aside or after == answers
    assert examined(path).is_sound
    with Campaign.from_file(folder / "s.toml") as campaign:
        assert len(campaign.ask()) <= len(lost)
    return len(left), len(left & after.keys())


@pytest.mark.parametrize("kind", KINDS)
def test_corruptions_are_noticed_and_what_is_readable_is_saved(sound, tmp_path, kind):
    counts = [corrupted_and_recovered(sound, tmp_path, kind, seed) for seed in range(3)]
    assert sum(kept for _, kept in counts) >= SHARE * sum(there for there, _ in counts)


@pytest.mark.slow
@pytest.mark.count
@pytest.mark.parametrize("kind", KINDS)
def test_two_hundred_corruptions(sound, tmp_path, kind):
    counts = [
        corrupted_and_recovered(sound, tmp_path, kind, seed) for seed in range(SHIFT + 100, SHIFT + 125)
    ]
    assert sum(kept for _, kept in counts) >= SHARE * sum(there for there, _ in counts)


@pytest.mark.parametrize("byte", [0xE5, 0xFF])
def test_a_schema_that_is_no_text_is_damage(sound, tmp_path, byte):
    """SQLite quotes the schema in its message, which Python cannot decode then."""
    folder = tmp_path / "c"
    shutil.copytree(sound[0], folder)
    path = folder / "s.holdfast" / "runs.sqlite"
    data = bytearray(path.read_bytes())
    at = data.index(b"CREATE TABLE evaluation")
    data[at + 13 : at + 15] = bytes([byte, 0x20])
    path.write_bytes(data)
    assert not examined(path).is_sound
    for way in (Store.reading, Store.opened):
        with pytest.raises(StoreError, match="is damaged"):
            way(path)
    (found,) = recovered(load_study(folder / "s.toml"), path.parent)
    assert found.saved == RUNS


def exported(sound, place):
    """The closed campaign with its exports."""
    folder = place / "exported"
    shutil.copytree(sound[0], folder)
    with CampaignView.opened(load_study(folder / "s.toml")) as view:
        write_all(view)
    return folder


def test_exports_stand_in_for_a_lost_database(sound, tmp_path):
    folder = exported(sound, tmp_path)
    place = folder / "s.holdfast"
    (place / "runs.sqlite").unlink()
    with pytest.raises(StoreError, match="lacks answers that were stored"):
        Campaign.from_file(folder / "s.toml")
    (found,) = recovered(load_study(folder / "s.toml"), place)
    assert (found.saved, found.exported, found.confirmed, found.missing) == (0, RUNS, RUNS, 0)
    assert values_in(folder) == sound[2]
    assert f"{RUNS} more from runs.csv, {RUNS} of them confirmed by results.nc" in recovery_lines([found])[1]


def test_a_changed_digit_in_an_export_is_not_confirmed(sound, tmp_path):
    folder = exported(sound, tmp_path)
    place = folder / "s.holdfast"
    (place / "runs.sqlite").unlink()
    first, *rest = (place / "runs.csv").read_text().splitlines()
    cells = rest[0].split(",")
    cells[5] = "0.5"
    inputs = rest[1].split(",")
    inputs[3] = "0.123"  # the key is of other inputs
    (place / "runs.csv").write_text("\n".join([first, ",".join(cells), ",".join(inputs), *rest[2:]]) + "\n")
    (found,) = recovered(load_study(folder / "s.toml"), place)
    assert (found.exported, found.confirmed) == (RUNS - 1, RUNS - 2)
    assert "1 of these have values that nothing confirms" in "\n".join(recovery_lines([found]))
    (place / "results.nc").write_bytes(b"CDF\x02 no")
    (place / "runs.sqlite").unlink()
    (found,) = recovered(load_study(folder / "s.toml"), place)
    assert (found.exported, found.confirmed) == (RUNS - 1, 0)


def test_a_sound_store_is_left_as_it_is(sound, tmp_path):
    folder = tmp_path / "c"
    shutil.copytree(sound[0], folder)
    before = (folder / "s.holdfast" / "runs.sqlite").read_bytes()
    (found,) = recovered(load_study(folder / "s.toml"), folder / "s.holdfast")
    assert found.aside is None
    assert recovery_lines([found]) == [f"runs.sqlite: sound, left as it is; {RUNS} answered runs"]
    assert (folder / "s.holdfast" / "runs.sqlite").read_bytes() == before
    with pytest.raises(StoreError, match="no database"):
        recovered(load_study(folder / "s.toml"), tmp_path)
    with pytest.raises(StoreError, match="no database"):
        examined(tmp_path / "runs.sqlite")


def test_a_value_that_was_changed_from_outside_is_not_shown(sound, tmp_path):
    folder = tmp_path / "c"
    shutil.copytree(sound[0], folder)
    path = folder / "s.holdfast" / "runs.sqlite"
    (path.parent / ".runs.sqlite.witness").unlink()  # its digest would tell at once
    db = sqlite3.connect(path)
    db.execute("DROP TRIGGER evaluation_changed")
    db.execute("UPDATE evaluation SET outputs = '{\"y\": 0.5}' WHERE id = 7")
    db.commit()
    db.close()
    with (
        CampaignView.opened(load_study(folder / "s.toml")) as view,
        pytest.raises(StoreError, match=r"run 7 \(.*\) is not as it was stored. `holdfast doctor --store`"),
    ):
        view.runs()
    with pytest.raises(StoreError, match=r"run 7 \(.*\) is not as it was stored"):
        report_numbers(path.parent)
    assert any("1 of evaluation (7)" in line for line in examined(path).lines())


@pytest.mark.parametrize("step", ["write", "aside", "log", "replace"])
def test_a_kill_while_saving_loses_nothing(sound, tmp_path, monkeypatch, step):
    from workbench.campaign.rescue import recovery

    folder = tmp_path / "c"
    shutil.copytree(sound[1], folder)
    damage(folder, "page", random.Random(3))
    place = folder / "s.holdfast"

    class Killed(BaseException):
        pass

    def dies(*arguments, **options):
        raise Killed

    target = {"write": "_write", "aside": "_put_aside"}.get(step)
    with monkeypatch.context() as patched:
        if target is not None:
            patched.setattr(recovery, target, dies)
        elif step == "log":
            patched.setattr(recovery.Path, "unlink", _dying_at("-wal", recovery.Path.unlink, Killed))
        else:
            patched.setattr(recovery.os, "replace", _dying_at("runs.sqlite", recovery.os.replace, Killed))
        with pytest.raises(Killed):
            recovered(load_study(folder / "s.toml"), place)
    (found,) = recovered(load_study(folder / "s.toml"), place)
    twin = tmp_path / "twin"
    shutil.copytree(sound[1], twin)
    damage(twin, "page", random.Random(3))
    (whole,) = recovered(load_study(twin / "s.toml"), twin / "s.holdfast")
    assert (found.saved, found.missing) == (whole.saved, whole.missing)
    assert values_in(folder) == values_in(twin)


def _dying_at(end, plain, error):
    def step(*arguments, **options):
        if str(arguments[-1]).endswith(end) and ".part" not in str(arguments[0]):
            raise error
        return plain(*arguments, **options)

    return step


def test_an_older_witness_is_no_alarm(sound, tmp_path):
    folder = tmp_path / "c"
    shutil.copytree(sound[0], folder)
    path = folder / "s.holdfast" / "runs.sqlite"
    beside = path.with_name(".runs.sqlite.witness")
    assert witness_says(path)["last"]["key"]
    for text in ("", "{", '{"last": {"key": 1}}', "[]"):
        beside.write_text(text)
        assert witness_says(path) == {}
        Store.opened(path).close()
    assert witness_says(path)["file"]["size"] == path.stat().st_size


def test_two_campaigns_join(sound, tmp_path):
    from workbench.campaign.rescue.merging import merged, merging_lines
    from workbench.errors import StudyError

    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    for folder in (ours, theirs):
        shutil.copytree(sound[0], folder)
    with Campaign.from_file(theirs / "s.toml") as campaign:
        campaign.tell(None, 9.0, parameters={"a": 0.25, "b": 0.5})
        campaign.tell(None, 8.0, parameters={"a": 0.5, "b": 0.5})
        campaign.tell(None, failure="it broke", parameters={"a": 0.75, "b": 0.5})
    with Campaign.from_file(ours / "s.toml") as campaign:
        campaign.tell(None, 7.0, parameters={"a": 0.5, "b": 0.5})
        found = merged(campaign, theirs / "s.holdfast")
        assert (found.joined, found.same, found.different, found.other_model) == (2, RUNS, 1, 0)
        assert "1 run has another answer there" in merging_lines(found, theirs)[1]
        again = merged(campaign, theirs / "s.holdfast")
        assert (again.joined, again.same, again.different) == (0, RUNS + 2, 1)
        values = {tuple(row.inputs.values()): row.outputs.get("y") for row in campaign.runs()}
        assert values[0.25, 0.5] == 9.0
        assert values[0.5, 0.5] == 7.0
        key = campaign.key({"a": 0.5, "b": 0.5})
        assert [a[2] for a in campaign.store.attempts(key)] == ["merged"]
        with pytest.raises(StudyError, match="is this campaign itself"):
            merged(campaign, ours / "s.holdfast")
        with pytest.raises(StudyError, match=r"nowhere is no folder. Give the folder of the other campaign"):
            merged(campaign, tmp_path / "nowhere")
        with pytest.raises(StudyError, match=r"theirs holds no campaign: it has no runs.sqlite. Give"):
            merged(campaign, theirs)
        damage(theirs, "bits", random.Random(1))
        with pytest.raises(HoldfastError, match=r"not sound, nothing was joined|is damaged"):
            merged(campaign, theirs / "s.holdfast")
    with OpenStore(ours / "s.holdfast") as store:
        assert store.check() == []


def test_another_model_or_state_is_not_joined(tmp_path):
    from workbench.campaign.rescue.merging import merged
    from workbench.errors import StudyError

    rest = (
        '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n[[response]]\nname = "y"\n'
        '[evaluate]\nengine = "inline"\n'
    )

    def made(name, function, code):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "m.py").write_text(code)
        text = f'[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "m.py:{function}"\n{rest}'
        (folder / "s.toml").write_text(text)
        with Campaign.from_file(folder / "s.toml") as campaign:
            campaign.evaluate([{"a": 0.5}, {"a": 0.25 if name == "twin" else 0.5}])
        return folder

    ours = made("ours", "f", "def f(a): return a")
    twin = made("twin", "f", "def f(a):\n    # the same\n    return a")
    state = made("state", "f", "def f(a): return 2 * a")
    model = made("model", "g", "def g(a): return a")
    with Campaign.from_file(ours / "s.toml") as campaign:
        assert merged(campaign, twin / "s.holdfast").joined == 1
        with pytest.raises(StudyError, match=r"1 run in .* was made by another state of the model"):
            merged(campaign, state / "s.holdfast")
        with pytest.raises(StudyError, match=r"no run in .* is of this study's model"):
            merged(campaign, model / "s.holdfast")

"""Where runs fail, by level of the unordered parameters."""

from workbench import Parameter, Space
from workbench.search.evidence.failure_map import failure_map, failure_places

DESIGN = Space([Parameter("x", lower=0, upper=1), Parameter("seat", kind="categorical", levels=("a", "b"))])
UNCERTAIN = Space([Parameter("u", lower=0, upper=1), Parameter("belt", kind="binary")])


def _map(fails, n=40):
    rows = [{"x": i / n, "seat": "ab"[i % 2], "u": (7 * i % n) / n, "belt": i // 2 % 2} for i in range(n)]
    return failure_map(rows, [fails(row) for row in rows], design=DESIGN, uncertainty=UNCERTAIN)


def test_a_level_that_always_fails_is_singled_out_with_its_counts():
    levels = _map(lambda row: row["belt"] == 1)
    assert [(v.side, v.parameter, v.level) for v in levels] == [
        ("design", "seat", "a"),
        ("design", "seat", "b"),
        ("uncertainty", "belt", 0),
        ("uncertainty", "belt", 1),
    ]
    assert [(v.runs, v.failed, v.elsewhere) for v in levels] == [
        (20, 10, (10, 20)),
        (20, 10, (10, 20)),
        (20, 0, (20, 20)),
        (20, 20, (0, 20)),
    ]
    assert [v.is_singled_out for v in levels] == [False, False, False, True]
    assert failure_places(levels) == "Runs fail more often at belt=1 (all 20 failed, 0 of 20 elsewhere)."


def test_failures_that_know_no_level_single_none_out():
    levels = _map(lambda row: row["x"] > 0.7)
    assert sum(level.failed for level in levels if level.parameter == "seat") == 11
    assert failure_places(levels) == ""


def test_a_few_failures_by_chance_at_one_level_single_none_out():
    assert failure_places(_map(lambda row: row["x"] in (0.025, 0.125))) == ""


def test_without_failures_there_is_no_map():
    assert _map(lambda row: False) == ()

"""What the benchmarks print becomes rows of the history."""

import csv
import subprocess

import pytest

from tests.bench.history import HEADER, append, commit_of, machine, timed_row


@pytest.mark.parametrize(
    ("line", "row"),
    [
        ("  1044, joint    gradient       12.500 ms   ratio 1.4", ("1044, joint gradient", 0.0125)),
        ("ours, 50 x 20   CPU s    0.250 (0.2 to 0.3)", ("ours, 50 x 20", 0.25)),
        ("fit   50 x 20     1.250 CPU s   Q2 0.99", ("fit 50 x 20", 1.25)),
        ("still 640 x 400, 4 rays a pixel: 2e-1 s CPU", ("still 640 x 400, 4 rays a pixel:", 0.2)),
        ("D = 46.3 %  (20 seeds)", None),
    ],
)
def test_a_printed_time_is_a_row(line, row):
    assert timed_row(line) == row


def test_rows_are_appended_below_one_header(tmp_path):
    for commit in ("a1b2c3d", "d4e5f6a"):
        append(tmp_path / "history.csv", commit, [("test_a.py::test_b", "ours, 50 x 20", 0.123456789)])
    table = list(csv.reader((tmp_path / "history.csv").read_text().splitlines()))
    assert table[0] == list(HEADER)
    assert [row[0] for row in table[1:]] == ["a1b2c3d", "d4e5f6a"]
    assert table[1][2:] == [machine(), "test_a.py::test_b", "ours, 50 x 20", "0.123457"]


def test_a_changed_file_is_said_with_the_commit(tmp_path):
    def git(*words):
        name = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", *name, *words], cwd=tmp_path, check=True, capture_output=True)

    (tmp_path / "a").write_text("1")
    git("init")
    git("add", "a")
    git("commit", "-m", "First")
    clean = commit_of(tmp_path)
    (tmp_path / "a").write_text("2")
    assert commit_of(tmp_path) == f"{clean}+"

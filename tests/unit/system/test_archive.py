"""Archives: what is unpacked, and the crafted ones that are refused with nothing written outside."""

import stat
import zipfile

import pytest

from workbench.errors import StudyError
from workbench.system.archive import unpack


def archive(path, entries):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content, mode in entries:
            info = zipfile.ZipInfo(name)
            info.external_attr = mode << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            file.writestr(info, content)
    return path


def test_files_and_folders_come_out(tmp_path):
    path = archive(
        tmp_path / "a.zip",
        [("a/b.txt", b"hello", 0o644), ("run", b"#!/bin/sh", 0o755), ("empty/", b"", 0o755)],
    )
    unpack(path, tmp_path / "out", what="FMU a")
    assert (tmp_path / "out" / "a" / "b.txt").read_bytes() == b"hello"
    assert (tmp_path / "out" / "run").stat().st_mode & stat.S_IXUSR
    assert (tmp_path / "out" / "empty").is_dir()


LINK = stat.S_IFLNK | 0o777
CRAFTED = [
    ([("../up.txt", b"x", 0o644)], "needs to be a path inside"),
    ([("a/../../up.txt", b"x", 0o644)], "needs to be a path inside"),
    ([("/etc/x", b"x", 0o644)], "needs to be a path inside"),
    ([("..\\up.txt", b"x", 0o644)], "needs to be a path inside"),
    ([("C:/x", b"x", 0o644)], "needs to be a path inside"),
    ([("link", b"/etc", LINK)], "FMU a holds the link 'link'"),
    ([("link", b"..", LINK), ("link/up.txt", b"x", 0o644)], "FMU a holds the link 'link'"),
    ([("a\nb", b"x", 0o644)], "needs to be a path inside"),
    ([("bomb", b"\0" * 5_000_000, 0o644)], "unpacks from .* to 5000000 bytes, which no model needs"),
    ([(f"bomb{k}", b"\0" * 400_000, 0o644) for k in range(10)], "which no model needs"),
    ([(f"f{k}", b"", 0o644) for k in range(20_001)], "holds 20001 files, at most 20000"),
]


@pytest.mark.parametrize(
    ("entries", "words"), CRAFTED, ids=[f"{e[0][0][:20]!r} {n}" for n, (e, _) in enumerate(CRAFTED)]
)
def test_crafted_archives_write_nothing(tmp_path, entries, words):
    path = archive(tmp_path / "a.zip", entries)
    with pytest.raises(StudyError, match=words):
        unpack(path, tmp_path / "in" / "out", what="FMU a")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.zip"]


def test_the_same_name_twice_and_what_is_no_archive(tmp_path):
    with zipfile.ZipFile(tmp_path / "twice.zip", "w") as file:
        file.writestr("a", b"1")
        with pytest.warns(UserWarning, match="Duplicate name"):
            file.writestr("a", b"2")
    with pytest.raises(StudyError, match="holds 'a' twice"):
        unpack(tmp_path / "twice.zip", tmp_path / "out", what="FMU a")
    (tmp_path / "no.zip").write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(StudyError, match="FMU a cannot be unpacked: "):
        unpack(tmp_path / "no.zip", tmp_path / "out", what="FMU a")


def test_sizes_that_lie(tmp_path):
    path = archive(tmp_path / "a.zip", [("a", b"x" * 3_000_000, 0o644)])
    data = path.read_bytes()
    path.write_bytes(data.replace((3_000_000).to_bytes(4, "little"), (1000).to_bytes(4, "little")))
    with pytest.raises(StudyError, match=r"is longer than the archive says|cannot be unpacked"):
        unpack(path, tmp_path / "out", what="FMU a")

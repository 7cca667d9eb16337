"""Files that a run of a command leaves behind to be read again: one archive per run, of limited size.

`[model] keep` names them, patterns such as "*.csv" allowed; without it they are the files that the responses
are read from, and all files where a function reads, which names none. A run whose files are larger than the
limit, compressed, keeps the smallest of them that fit; of files that nobody named all or none.
"""

import io
import shutil
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from fnmatch import fnmatch
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

__all__ = ["ARCHIVE", "LIMIT_ASKED", "LIMIT_UNASKED", "files_read", "leave_kept", "unpacked"]

ARCHIVE = "kept.zip"
LIMIT_UNASKED = 100_000  # bytes per run, compressed, of files that nobody asked to keep
LIMIT_ASKED = 10_000_000
LARGEST_RATIO = 100  # files that no compression brings under the limit are not even tried
WHOLE = "/"  # all files, or only those that are named: of a part of them a function might read something else
RAW = 10  # times the limit that a whole folder may have before it is compressed
EPOCH = (1980, 1, 1, 0, 0, 0)  # no times: the same files give the same bytes


def files_read(rules: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The files that responses are read from; a reader that is a function names none and may want any."""
    named = sorted({rule["file"] for rule in rules.values() if "file" in rule})
    return [*named, WHOLE] if any("function" in rule for rule in rules.values()) else named


def leave_kept(workdir: Path, patterns: Sequence[str], *, limit: int) -> None:
    """Remove the folder of a run but for an archive of what is kept; the folder, too, where nothing is."""
    content = _packed(workdir, patterns, limit)
    shutil.rmtree(workdir, ignore_errors=True)
    if content is not None:
        workdir.mkdir(parents=True, exist_ok=True)
        (workdir / ARCHIVE).write_bytes(content)


def _packed(workdir: Path, patterns: Sequence[str], limit: int) -> bytes | None:
    chosen = _chosen(workdir, patterns, limit)
    if not chosen:
        return None
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in chosen:
            entry = zipfile.ZipInfo(name, date_time=EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, (workdir / name).read_bytes())
    return buffer.getvalue()


def _chosen(workdir: Path, patterns: Sequence[str], limit: int) -> list[str]:
    """The files that match, the smallest first, as long as they fit into the limit."""
    sizes = {
        str(path.relative_to(workdir)): path.stat().st_size
        for path in sorted(workdir.rglob("*"))
        if path.is_file() and not path.is_symlink()
    }
    if WHOLE in patterns:
        every = sorted(sizes, key=sizes.__getitem__)
        if sum(sizes.values()) <= RAW * limit and _fitting(workdir, every, sizes, limit) == every:
            return every
    wanted = [name for name in sizes if any(fnmatch(name, p) for p in patterns if p != WHOLE)]
    wanted.sort(key=sizes.__getitem__)
    return _fitting(workdir, wanted, sizes, limit)


def _fitting(workdir: Path, wanted: list[str], sizes: Mapping[str, int], limit: int) -> list[str]:
    """The first of the wanted files, compressed, that the limit has room for."""
    if sum(sizes[name] for name in wanted) <= limit:
        return wanted
    room, chosen = limit, []
    for name in wanted:
        if sizes[name] > LARGEST_RATIO * limit:
            break
        room -= len(zlib.compress((workdir / name).read_bytes()))
        if room < 0:
            break
        chosen.append(name)
    return chosen


@contextmanager
def unpacked(archive: Path) -> Iterator[Path]:
    """A folder with the files of an archive, for as long as the block runs.

    Raises:
        OSError: the archive cannot be read, or is none.
    """
    with TemporaryDirectory(prefix="holdfast-kept-") as name:
        try:
            with zipfile.ZipFile(archive) as content:
                content.extractall(name)
        except zipfile.BadZipFile as exc:
            raise OSError(f"{archive} is damaged: {exc}") from None
        yield Path(name)

"""Archives unpacked without surprises: nothing outside the folder, no links, no bombs."""

import stat
import zipfile
from pathlib import Path

from workbench.errors import StudyError
from workbench.system.confined import confined

__all__ = ["unpack"]

LARGEST = 2_000_000_000  # bytes when unpacked
MOST = 20_000  # files
RATIO = 300  # unpacked over packed, beyond the first megabyte


def unpack(archive: Path, folder: Path, *, what: str) -> None:
    """Unpack a zip archive into `folder`.

    Raises:
        StudyError: it is no archive, names a place outside, holds a link, or grows beyond all measure.
    """
    try:
        with zipfile.ZipFile(archive) as file:
            entries = file.infolist()
            _check(entries, folder, what)
            left = LARGEST
            for entry in entries:
                target = confined(folder, entry.filename, what=f"entry of {what}")
                if entry.is_dir():
                    target.mkdir(parents=True, exist_ok=True)
                    continue
                target.parent.mkdir(parents=True, exist_ok=True)
                left -= _copy(file, entry, target, min(left, entry.file_size), what)
    # NotImplementedError: a compression that zipfile does not know; RuntimeError: a password
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, OSError) as exc:
        if isinstance(exc, StudyError):
            raise
        raise StudyError(f"{what} cannot be unpacked: {exc}") from None


def _check(entries: list[zipfile.ZipInfo], folder: Path, what: str) -> None:
    if len(entries) > MOST:
        raise StudyError(f"{what} holds {len(entries)} files, at most {MOST}")
    packed, unpacked = sum(e.compress_size for e in entries), sum(e.file_size for e in entries)
    if unpacked > LARGEST or unpacked > 1_000_000 + RATIO * packed:
        raise StudyError(f"{what} unpacks from {packed} to {unpacked} bytes, which no model needs")
    seen = set()
    for entry in entries:
        confined(folder, entry.filename, what=f"entry of {what}")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise StudyError(f"{what} holds the link {entry.filename!r}")
        if entry.filename in seen:
            raise StudyError(f"{what} holds {entry.filename!r} twice")
        seen.add(entry.filename)


def _copy(file: zipfile.ZipFile, entry: zipfile.ZipInfo, target: Path, most: int, what: str) -> int:
    """Write one entry; the sizes in the directory of an archive may lie."""
    written = 0
    with file.open(entry) as source, open(target, "wb") as sink:
        while chunk := source.read(1 << 20):
            written += len(chunk)
            if written > most:
                raise StudyError(f"{what}: {entry.filename!r} is longer than the archive says")
            sink.write(chunk)
    mode = entry.external_attr >> 16
    if mode & stat.S_IXUSR:
        target.chmod(0o755)
    return written

"""Files written whole: to a new name, synced, renamed. A reader sees old content or new, never a part."""

import json
import os
from pathlib import Path
from typing import Any

from workbench.errors import StoreError

__all__ = ["read_json", "write_json", "write_text", "write_whole"]


def write_whole(path: Path, content: bytes) -> None:
    """Replace the file at `path` by `content`, or leave it untouched.

    Raises:
        StoreError: the disk is full, the folder read-only or gone.
    """
    new = path.with_name(f".{path.name}.new")
    try:
        with open(new, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
        _sync_folder(path.parent)
    except OSError as exc:
        new.unlink(missing_ok=True)
        raise StoreError(
            f"cannot write {path}: {exc.strerror or exc}. Free space or choose another --folder"
        ) from exc


def write_text(path: Path, text: str) -> None:
    """`write_whole` for text in UTF-8."""
    write_whole(path, text.encode())


def write_json(path: Path, data: Any) -> None:
    """`write_whole` for JSON: sorted keys, full precision, no NaN (it is not JSON)."""
    write_text(path, json.dumps(data, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n")


def read_json(path: Path) -> Any:
    """The content of a JSON file, None when there is no such file.

    Raises:
        StoreError: the file cannot be read or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as exc:
        raise StoreError(f"cannot read {path}: {exc}. Remove the file to have it made anew") from exc


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        pass  # some network file systems cannot sync a folder; the file itself is synced
    finally:
        os.close(handle)

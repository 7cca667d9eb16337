"""The beginning and the end of a log: where a solver says what it read, and why it stopped."""

from pathlib import Path

__all__ = ["HEAD", "TAIL", "ends_of"]

HEAD, TAIL = 600, 3300  # bytes that are kept


def ends_of(log: Path) -> str:
    """The first and the last bytes of a log, with what is not text made visible; empty without a log."""
    try:
        size = log.stat().st_size
        with open(log, "rb") as file:
            if size <= HEAD + TAIL:
                parts = [file.read(HEAD + TAIL)]
            else:
                parts = [file.read(HEAD)]
                file.seek(size - TAIL)
                parts.append(file.read(TAIL))
    except OSError:
        return ""
    between = f"\n... {size - HEAD - TAIL} bytes are left out ...\n"
    text = between.join(part.decode("utf-8", errors="backslashreplace") for part in parts)
    return text.replace("\0", "\\0").strip()

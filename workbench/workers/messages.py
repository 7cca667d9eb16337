"""Messages between a coordinator and its workers: JSON, with long rows of numbers behind it as they are.

    8 bytes   length of what follows
    8 bytes   length of the JSON
    JSON      in which {"\\0part": [first byte, bytes]} stands for a part
    parts     one behind the other

Numbers are doubles with the low byte first. A part that stands in a message several times, such as the times
of several histories, travels once.
"""

import json
from typing import Any, BinaryIO

import numpy as np

from workbench.models.histories import History
from workbench.models.protocol import Answer

__all__ = ["answer_from_dict", "answer_to_dict", "opened", "pack", "receive"]

PART = "\0part"  # no name of anything
DOUBLES = np.dtype("<f8")


def pack(message: Any) -> bytes:
    """A message of plain types and bytes as it travels."""
    parts: list[bytes] = []
    places: dict[int, list[int]] = {}

    def placed(part: Any) -> dict[str, list[int]]:
        if not isinstance(part, bytes):
            raise TypeError(f"a message holds plain types and bytes, got {type(part).__name__}")
        if id(part) not in places:
            places[id(part)] = [sum(map(len, parts)), len(part)]
            parts.append(part)
        return {PART: places[id(part)]}

    head = json.dumps(message, allow_nan=False, separators=(",", ":"), default=placed).encode()
    size = 8 + len(head) + sum(map(len, parts))
    return b"".join([size.to_bytes(8, "big"), len(head).to_bytes(8, "big"), head, *parts])


def opened(body: bytes) -> Any:
    """The message in what follows the first eight bytes of it as it travels.

    >>> opened(pack({"a": [1, b"xyz"]})[8:])
    {'a': [1, b'xyz']}
    """
    begin = 8 + int.from_bytes(body[:8], "big")
    if len(body) == begin:
        return json.loads(body[8:])
    found: dict[int, bytes] = {}

    def restored(mapping: dict[str, Any]) -> Any:
        if PART not in mapping:
            return mapping
        first, size = mapping[PART]
        if first not in found or len(found[first]) != size:
            found[first] = body[begin + first : begin + first + size]
        return found[first]

    return json.loads(body[8:begin], object_hook=restored)


def receive(pipe: BinaryIO) -> Any:
    """The next message, None at the end of the pipe."""
    head = pipe.read(8)
    if len(head) < 8:
        return None
    return opened(pipe.read(int.from_bytes(head, "big")))


def answer_to_dict(answer: Answer) -> dict[str, Any]:
    """Plain types, and the histories as bytes; equal times are one object."""
    once: dict[bytes, bytes] = {}

    def doubles(row: Any) -> bytes:
        content = np.asarray(row, dtype=DOUBLES).tobytes()
        return once.setdefault(content, content)

    return {
        "status": answer.status,
        "outputs": dict(answer.outputs),
        "gradients": {name: dict(by) for name, by in answer.gradients.items()},
        "histories": {name: [doubles(h.time), doubles(h.values)] for name, h in answer.histories.items()},
        "kept": dict(answer.kept),
        "error": answer.error,
        "log": answer.log,
        "wall": answer.wall,
        "cpu": answer.cpu,
        "host": answer.host,
    }


def answer_from_dict(data: dict[str, Any]) -> Answer:
    """The answer of a mapping as `answer_to_dict` writes it; times that are one object there are one here."""
    rows: dict[int, np.ndarray] = {}

    def row(content: bytes) -> np.ndarray:
        if id(content) not in rows:
            rows[id(content)] = np.frombuffer(content, dtype=DOUBLES)
        return rows[id(content)]

    histories = {name: History(row(t), row(y)) for name, (t, y) in data["histories"].items()}
    return Answer(**{**data, "histories": histories})

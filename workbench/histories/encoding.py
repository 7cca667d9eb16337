"""Rows of doubles in few bytes, every bit kept: what is left over by a polynomial, byte by byte, deflated.

    whole numbers   doubles as unsigned 64-bit numbers in the order of their values: the bits, with the sign
                    bit turned over for positive numbers and all bits for negative ones
    remainders      differences of order k, modulo 2^64: what the polynomial of degree k - 1 through the last
                    k samples does not foresee; summed up k times they give the numbers back, bit by bit
    bytes           remainders with their sign in the lowest bit, first all highest bytes, then the next, ...
    deflate         zlib at its quickest level, with its Adler-32; lowest bytes that are noise stay plain

The order is the one, of 0 to 5, that leaves the fewest bits in some of the samples. A row goes in parts of
CHUNK samples, each of which is read without the others:

    1 byte               how many of the lowest bytes are plain
    width bytes each     those
    deflated             1 byte order, 4 bytes CRC-32 of all that stands before, 4 bytes seal, the other bytes

By the seal a part is known that stands in the place of another.
"""

import zlib
from collections.abc import Sequence

import numpy as np

__all__ = ["CHUNK", "packed", "unpacked"]

CHUNK = 512  # samples per part: an instant of 10 000 runs takes 10 000 parts
ORDERS = 6
LOOKS = 4  # parts of a row from which its order is found, and samples of each
LOOKED_AT = 256
TOP = np.uint64(1 << 63)
HEAD = 9  # deflated bytes before the remainders: order, CRC-32, seal
NOISE = 0.9  # of their size: what bytes at least still take, deflated, to be left plain


def packed(row: np.ndarray, *, seal: int = 0, chunk: int = CHUNK) -> list[bytes]:
    """The parts of a row of doubles.

    Args:    row: (n,)    seal: of the first part, the next ones count up    chunk: samples per part
    Returns: ceil(n / chunk) parts.

    >>> row = np.array([1.0, 1.5, np.nan, -0.0])
    >>> unpacked(packed(row, seal=7), len(row), seals=[7])[0].tolist()
    [1.0, 1.5, nan, -0.0]
    """
    n = len(row)
    if n == 0:
        return []
    width = min(chunk, n)
    count = -(-n // width)
    numbers = np.empty((count, width), dtype=np.uint64)
    flat = numbers.reshape(-1)
    flat[:n] = _in_order(np.ascontiguousarray(row, dtype=np.float64))
    flat[n:] = flat[n - 1]
    looks = slice(None, None, max(1, count // LOOKS))
    order = _best_order(numbers[looks, :LOOKED_AT])
    for _ in range(order):
        numbers[:, 1:] -= numbers[:, :-1].copy()
    planes = _sign_last(numbers).astype(">u8").view(np.uint8).reshape(count, width, 8).transpose(0, 2, 1)
    plain = _noisy(planes[looks, :, :LOOKED_AT])
    content = np.ascontiguousarray(planes).reshape(count, 8 * width)
    end = (8 - plain) * width
    return [_part(order, seal + k, plain, content[k, :end], content[k, end:]) for k in range(count)]


def _part(order: int, seal: int, plain: int, high: np.ndarray, low: np.ndarray) -> bytes:
    before = bytes([plain]) + low.tobytes()
    head = bytes([order]) + zlib.crc32(before).to_bytes(4, "big") + (seal & 0xFFFFFFFF).to_bytes(4, "big")
    return before + zlib.compress(head + high.tobytes(), 1)


def unpacked(parts: Sequence[bytes], width: int, *, seals: Sequence[int]) -> np.ndarray:
    """The samples of parts of `width` samples each, of one row or of many.

    Returns: (parts, width).  Raises ValueError when a part is not as it was stored, or another one.
    """
    found = np.empty((len(parts), width))
    if not parts:
        return found
    orders = np.empty(len(parts), dtype=np.uint8)
    planes = np.empty((len(parts), 8 * width), dtype=np.uint8)
    for k, part in enumerate(parts):
        begin = 1 + part[0] * width if part else 0
        try:
            body = zlib.decompress(part[begin:])
        except zlib.error as exc:
            raise ValueError(f"part {k} is not as it was stored: {exc}") from None
        if len(body) != HEAD + 8 * width + 1 - begin or int.from_bytes(body[1:5], "big") != zlib.crc32(
            part[:begin]
        ):
            raise ValueError(f"part {k} is not as it was stored, or not of {width} samples")
        if body[5:HEAD] != (seals[k] & 0xFFFFFFFF).to_bytes(4, "big"):
            raise ValueError(f"part {k} is another one: it stands in the wrong place")
        orders[k] = body[0]
        planes[k] = np.frombuffer(body[HEAD:] + part[1:begin], dtype=np.uint8)
    for order in np.unique(orders):
        these = np.flatnonzero(orders == order)
        some = planes[these].reshape(len(these), 8, width).transpose(0, 2, 1)
        numbers = np.ascontiguousarray(some).view(">u8")[..., 0].astype(np.uint64)
        numbers = (numbers >> np.uint64(1)) ^ (np.uint64(0) - (numbers & np.uint64(1)))
        for _ in range(int(order)):
            np.cumsum(numbers, axis=1, out=numbers)
        found[these] = np.where(numbers & TOP, numbers ^ TOP, ~numbers).view(np.float64)
    return found


def _in_order(row: np.ndarray) -> np.ndarray:
    """Doubles as unsigned numbers that rise where they rise."""
    bits = row.view(np.uint64)
    return np.where(bits & TOP, ~bits, bits | TOP)


def _sign_last(numbers: np.ndarray) -> np.ndarray:
    """Numbers around 0, modulo 2^64, as small ones: 0, -1, 1, -2, ... become 0, 1, 2, 3, ..."""
    signed = numbers.view(np.int64)
    folded: np.ndarray = ((signed << 1) ^ (signed >> 63)).view(np.uint64)
    return folded


def _best_order(rows: np.ndarray) -> int:
    """The order of differences that leaves the fewest bits."""
    left, bits = rows.copy(), []
    for _ in range(ORDERS):
        bits.append(np.log2(1.0 + _sign_last(left)).sum())
        left[:, 1:] -= left[:, :-1].copy()
    return int(np.argmin(bits))


def _noisy(planes: np.ndarray) -> int:
    """How many of the lowest bytes deflating hardly makes smaller, of planes (parts, 8, samples)."""
    for k in range(8):
        content = planes[:, 7 - k].tobytes()
        if len(zlib.compress(content, 1)) < NOISE * len(content):
            return k
    return 8

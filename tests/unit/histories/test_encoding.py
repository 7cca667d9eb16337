"""Rows of doubles come back bit by bit, and what is damaged is known."""

from contextlib import suppress

import numpy as np
import pytest

from workbench.histories.encoding import CHUNK, packed, unpacked

T = np.linspace(0, 1, 10_000)
ROWS = {
    "smooth": np.exp(-3 * T) * np.sin(40 * T) * 1234.5,
    "noisy": np.sin(20 * T) + 1e-3 * np.random.default_rng(1).standard_normal(len(T)),
    "single precision": np.sin(20 * T).astype(np.float32),
    "printed": np.array([float(f"{v:.5g}") for v in 100 * np.sin(20 * T)]),
    "constant": np.full(len(T), -2.5),
    "pulse": np.where((T > 0.3) & (T < 0.5), np.sin(np.pi * (T - 0.3) / 0.2), 0) * 5e3,
    "bits": np.random.default_rng(2).bytes(80_000),
}
# bytes per sample of 8 that are enough; noise costs what it holds
ENOUGH = {"smooth": 2.7, "noisy": 6.4, "single precision": 1.4, "printed": 2.1, "constant": 0.2, "pulse": 1.3}


def back(parts, n, seal=0, chunk=CHUNK):
    return unpacked(parts, min(chunk, n), seals=range(seal, seal + len(parts))).ravel()[:n]


@pytest.mark.parametrize("name", ROWS)
@pytest.mark.parametrize("n", [1, 2, 511, 512, 513, 10_000])
def test_every_bit_comes_back(name, n):
    row = np.frombuffer(ROWS[name]) if name == "bits" else np.asarray(ROWS[name], dtype=float)
    row = row[:n]
    parts = packed(row, seal=99)
    assert len(parts) == -(-n // CHUNK)
    assert back(parts, n, seal=99).tobytes() == row.tobytes()
    if n == 10_000:
        assert sum(map(len, parts)) <= ENOUGH.get(name, 8.3) * n


def test_odd_numbers_and_other_layouts():
    odd = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, -np.nan, 5e-324, -5e-324, 1.7e308, -1.7e308])
    assert back(packed(odd), len(odd)).tobytes() == odd.tobytes()
    strided = np.arange(40.0)[::3]
    assert back(packed(strided), len(strided)).tolist() == strided.tolist()
    assert packed(np.empty(0)) == []
    assert unpacked([], 0, seals=[]).shape == (0, 0)
    assert back(packed(T, chunk=len(T)), len(T), chunk=len(T)).tobytes() == T.tobytes()


def test_one_part_is_read_without_the_others():
    row = ROWS["smooth"]
    parts = packed(row, seal=5)
    assert unpacked(parts[7:8], CHUNK, seals=[12])[0].tobytes() == row[7 * CHUNK : 8 * CHUNK].tobytes()


def test_a_part_in_the_place_of_another_is_known():
    parts = packed(ROWS["smooth"], seal=5)
    with pytest.raises(ValueError, match="part 1 is another one: it stands in the wrong place"):
        unpacked([parts[0], parts[2]], CHUNK, seals=[5, 6])
    with pytest.raises(ValueError, match="part 0 is not as it was stored"):
        unpacked(parts[:1], 100, seals=[5])
    with pytest.raises(ValueError, match="part 0 is not as it was stored, or not of 100 samples"):
        unpacked(packed(np.full(512, 2.0)), 100, seals=[0])


@pytest.mark.parametrize("name", ["smooth", "noisy", "constant", "bits"])
def test_damage_is_known(name):
    row = np.frombuffer(ROWS[name]) if name == "bits" else ROWS[name]
    (part,) = packed(row[:CHUNK])
    rng = np.random.default_rng(3)
    for k in rng.integers(0, 8 * len(part), 200):
        damaged = bytearray(part)
        damaged[k // 8] ^= 1 << (k % 8)
        with suppress(ValueError):
            # bits that deflate does not use may be any
            assert unpacked([bytes(damaged)], CHUNK, seals=[0]).tobytes() == row[:CHUNK].tobytes()
    for end in (0, 1, len(part) // 2, len(part) - 1):
        with pytest.raises(ValueError, match="part 0 is not as it was stored"):
            unpacked([part[:end]], CHUNK, seals=[0])

"""Responses out of what CalculiX prints in `bracket.dat`, each a reader of `bracket.toml`."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["deflection", "frequency", "stress"]


def _block(lines: list[str], title: str) -> NDArray[np.float64]:
    """The first table under a line that begins with `title`, rows of numbers up to a line of words."""
    start = next((i for i, line in enumerate(lines) if line.strip().startswith(title)), None)
    if start is None:
        raise ValueError(f"bracket.dat has no table {title!r}: the solver stopped before it")
    rows: list[list[float]] = []
    for line in lines[start + 1 :]:
        if not line.strip():
            if rows:
                break
            continue
        rows.append([float(cell) for cell in line.split()])
    return np.array(rows)


def _lines(work: Path) -> list[str]:
    return (Path(work) / "bracket.dat").read_text().splitlines()


def deflection(work: Path) -> float:
    """Mean of the tip's displacement against the load, mm."""
    return float(-_block(_lines(work), "displacements")[:, 3].mean())


def stress(work: Path) -> float:
    """Largest von Mises stress of all integration points, MPa."""
    xx, yy, zz, xy, xz, yz = _block(_lines(work), "stresses")[:, 2:].T
    square = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + xz**2 + yz**2)
    return float(np.sqrt(square.max()))


def frequency(work: Path) -> float:
    """First natural frequency, Hz: mode, eigenvalue, rad/s, cycles, imaginary part."""
    lines = _lines(work)
    start = next(
        (i for i, line in enumerate(lines) if line.split() == list("EIGENVALUE") + list("OUTPUT")), None
    )
    rows = [] if start is None else [line.split() for line in lines[start + 1 :] if line.split()[:1] == ["1"]]
    if not rows:
        raise ValueError("bracket.dat has no eigenvalue: the solver stopped before it")
    return float(rows[0][3])

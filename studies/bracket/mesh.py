"""The mesh of a bracket and its deck for CalculiX: a profile of four-sided patches, extruded in layers.

The bracket is an angle: a leg against the wall (x = 0), an arm that carries the load, and a gusset between
them in the middle of the width. x points away from the wall, z up, y along the width.

    leg     0 .. t_leg in x, 0 .. height in z          arm     0 .. length in x, 0 .. t_arm in z
    gusset  between both, a triangle of legs gusset_x and gusset_z whose third side bulges a little

    python mesh.py sizes.json bracket.inp        # with the numbers of the run, in mm, N, t (tonnes), MPa
"""

import json
import sys
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["deck", "profile"]

Array = NDArray[np.float64]
Cells = list[tuple[int, int, int, int]]

ALONG_GUSSET, ALONG_REST, THROUGH, SIDE, RIB = 7, 5, 2, 2, 2  # elements
FULL = 0.62  # 0.5 would be a straight edge of the gusset, and an element with a straight angle
DIGITS = 9  # of a coordinate in mm by which nodes of neighbouring patches are one


def _patch(corners: Array, m: int, n: int) -> Array:
    """Points (m + 1, n + 1, 2) of a bilinear patch with corners (4, 2), counter-clockwise."""
    u, v = np.meshgrid(np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1), indexing="ij")
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1)
    return np.asarray(weights @ corners)


def profile(size: dict[str, float]) -> tuple[Array, Cells, Cells]:
    """Nodes (n, 2) of the profile, x and z; cells of the angle and of the gusset, counter-clockwise."""
    leg, arm = size["t_leg"], size["t_arm"]
    gx, gz = leg + size["gusset_x"], arm + size["gusset_z"]
    inner = [leg + FULL * size["gusset_x"], arm + FULL * size["gusset_z"]]

    def box(x0: float, x1: float, z0: float, z1: float) -> Array:
        return np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])

    angle = [
        _patch(box(0, leg, 0, arm), THROUGH, THROUGH),
        _patch(box(leg, gx, 0, arm), ALONG_GUSSET, THROUGH),
        _patch(box(gx, size["length"], 0, arm), ALONG_REST, THROUGH),
        _patch(box(0, leg, arm, gz), THROUGH, ALONG_GUSSET),
        _patch(box(0, leg, gz, size["height"]), THROUGH, ALONG_REST),
    ]
    gusset = [_patch(np.array([[leg, arm], [gx, arm], inner, [leg, gz]]), ALONG_GUSSET, ALONG_GUSSET)]
    number: dict[tuple[float, float], int] = {}

    def cells(patches: list[Array]) -> Cells:
        found = []
        for points in patches:
            at = np.empty((len(points), points.shape[1]), dtype=int)
            m, n = at.shape
            for i, j in product(range(m), range(n)):
                x, z = (round(float(c), DIGITS) for c in points[i, j])
                at[i, j] = number.setdefault((x, z), len(number))
            for i, j in product(range(m - 1), range(n - 1)):
                corners = at[i, j], at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]
                found.append((int(corners[0]), int(corners[1]), int(corners[2]), int(corners[3])))
        return found

    of_angle, of_gusset = cells(angle), cells(gusset)
    return np.array(list(number)), of_angle, of_gusset


def deck(size: dict[str, float]) -> str:
    """The deck: nodes, bricks, a bedded wall, the load on the tip, statics and the first frequency."""
    flat, angle, gusset = profile(size)
    half, rib = size["width"] / 2, size["t_gusset"] / 2
    across = np.unique(
        np.concatenate(
            [
                np.linspace(-half, -rib, SIDE + 1),
                np.linspace(-rib, rib, RIB + 1),
                np.linspace(rib, half, SIDE + 1),
            ]
        )
    )
    in_angle, layers = {n for cell in angle for n in cell}, len(across)
    middle = range(SIDE, SIDE + RIB)
    held = [
        [n for n in range(len(flat)) if n in in_angle or SIDE <= layer <= SIDE + RIB]
        for layer in range(layers)
    ]

    def label(n: int, layer: int) -> int:
        return 1 + n * layers + layer

    lines = ["*NODE, NSET=ALL"]
    for layer, y in enumerate(across):
        lines += [f"{label(n, layer)}, {flat[n, 0]:.9g}, {y:.9g}, {flat[n, 1]:.9g}" for n in held[layer]]
    lines.append("*ELEMENT, TYPE=C3D8I, ELSET=BODY")
    bricks = [(cell, layer) for layer in range(layers - 1) for cell in angle]
    bricks += [(cell, layer) for layer in middle for cell in gusset]
    for e, (cell, layer) in enumerate(bricks, 1):
        # y grows out of the plane of (x, z) the other way round: the near face comes second
        corners = [label(n, layer + 1) for n in cell] + [label(n, layer) for n in cell]
        lines.append(", ".join(map(str, [e, *corners])))
    share = np.gradient(across)
    share[[0, -1]] = np.diff(across)[[0, -1]] / 2
    lines += _bedding(flat, share, size, first=len(bricks) + 1, label=label)
    lines += [
        "*MATERIAL, NAME=METAL", "*ELASTIC", f"{size['young']:.9g}, {size['poisson']:.9g}",
        "*DENSITY", f"{size['density']:.9g}", "*SOLID SECTION, ELSET=BODY, MATERIAL=METAL",
    ]  # fmt: skip
    tip = [
        n
        for n in in_angle
        if abs(flat[n, 0] - size["length"]) < 1e-6 and abs(flat[n, 1] - size["t_arm"]) < 1e-6
    ]
    # a load beside the middle: weights that are linear over the width, with the moment wanted
    spread = float(share @ across**2)
    weights = share / share.sum() + share * across * size["beside"] * half / spread
    angle_of_load = np.deg2rad(size["direction"])
    lines += ["*STEP", "*STATIC", "*CLOAD"]
    for n in tip:
        for layer, weight in enumerate(weights):
            down = -size["force"] * weight * np.cos(angle_of_load)
            out = size["force"] * weight * np.sin(angle_of_load)
            lines += [f"{label(n, layer)}, 3, {down:.9g}", f"{label(n, layer)}, 1, {out:.9g}"]
    ends = [str(label(n, layer)) for n in tip for layer in range(layers)]
    lines += ["*NSET, NSET=TIP", ",\n".join(ends)]
    lines += ["*NODE PRINT, NSET=TIP", "U", "*EL PRINT, ELSET=BODY", "S", "*END STEP"]
    lines += ["*STEP", "*FREQUENCY", "1", "*END STEP"]
    return "\n".join(lines) + "\n"


def _bedding(
    flat: Array, share: Array, size: dict[str, float], *, first: int, label: Callable[[int, int], int]
) -> list[str]:
    """Springs off the wall on the back of the leg, by the area of each node; its upper edge cannot slide."""
    back = sorted((n for n in range(len(flat)) if abs(flat[n, 0]) < 1e-9), key=lambda n: flat[n, 1])
    heights = flat[back, 1]
    tall = np.gradient(heights)
    tall[[0, -1]] = np.diff(heights)[[0, -1]] / 2
    lines: list[str] = []
    springs: list[str] = []
    for i, n in enumerate(back):
        for layer, wide in enumerate(share):
            e = first + len(lines) // 2
            name = f"W{e}"
            lines += [f"*ELEMENT, TYPE=SPRING1, ELSET={name}", f"{e}, {label(n, layer)}"]
            springs += [f"*SPRING, ELSET={name}", "1", f"{size['bedding'] * tall[i] * wide:.8e}"]
    fixed = [f"{label(back[-1], layer)}, 2, 3" for layer in range(len(share))]
    return [*lines, *springs, "*BOUNDARY", *fixed]


if __name__ == "__main__":
    numbers = {key: float(value) for key, value in json.loads(Path(sys.argv[1]).read_text()).items()}
    Path(sys.argv[2]).write_text(deck(numbers))

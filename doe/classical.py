"""Classical designs in the unit cube: factorial, fractional, Plackett-Burman, central composite, Box-Behnken.

pyDOE3 builds what it builds correctly; each of its designs is checked here for run count, balance and
orthogonality before it is handed out. Two-level fractions and Box-Behnken designs are built here, because
pyDOE3 1.6 takes 16 runs for 7 factors at resolution III (8 suffice) and its Box-Behnken designs for 6 and 7
factors are not the published ones (Box & Behnken 1960). pyDOE3 takes most of a second to import: it is
loaded when asked for.

A level k of N stands at k/(N - 1); a design on [-1, 1] is mapped by u = (x + 1)/2.
"""

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.criteria.regression import Floats, checked

__all__ = [
    "box_behnken",
    "central_composite",
    "full_factorial",
    "orthogonal_array",
    "plackett_burman",
    "resolution",
    "two_level_fraction",
]

# blocks of factors that vary together, counted from 0; pairs for 3 to 5 factors
TRIPLES = {
    6: ((0, 1, 3), (1, 2, 4), (2, 3, 5), (0, 3, 4), (1, 4, 5), (0, 2, 5)),
    7: ((3, 4, 5), (0, 5, 6), (1, 4, 6), (0, 1, 3), (2, 3, 6), (0, 2, 4), (1, 2, 5)),
}
MOST_BASIC = 16  # 65,536 runs
NODES = 200_000  # vectors tried for one number of runs before the next is taken
EXACT = 1e-9


def full_factorial(levels: Sequence[int]) -> Floats:
    """All combinations of the factors' levels, the first factor fastest: (product of levels, d).

    >>> full_factorial([2, 3]).tolist()
    [[0.0, 0.0], [1.0, 0.0], [0.0, 0.5], [1.0, 0.5], [0.0, 1.0], [1.0, 1.0]]
    """
    counts = [int(k) for k in levels]
    if not counts or min(counts) < 2:
        raise ValueError(f"levels needs a number >= 2 for every factor, got {list(levels)}")
    from pyDOE3 import fullfact

    points = np.asarray(fullfact(counts), dtype=float) / (np.array(counts) - 1)
    _require(len(points) == np.prod(counts), "full factorial", "run count")
    _require(len(np.unique(points, axis=0)) == len(points), "full factorial", "distinct runs")
    return np.ascontiguousarray(points)


def two_level_fraction(d: int, *, resolution: int = 3) -> Floats:
    """The smallest regular two-level design found for d factors at a resolution: (2^k, d) of 0 and 1.

    Each factor is a vector of GF(2)^k, the set of basic factors it is the product of; resolution R means that
    any R - 1 of these vectors are independent. They are looked for depth first, in increasing order, from
    k = log2(d + 1) on; known minima are met for resolution III and IV at any d, for V up to 17 factors.

    >>> [len(two_level_fraction(7, resolution=r)) for r in (3, 4, 5)]
    [8, 16, 64]
    """
    if d < 1:
        raise ValueError(f"d needs a whole number of factors >= 1, got {d}")
    if resolution < 3:
        raise ValueError(f"resolution needs a whole number >= 3, got {resolution}")
    for k in range(max(1, int(d).bit_length()), MOST_BASIC + 1):
        found = _independent(d, k, resolution) if k < d else [1 << i for i in range(d)]
        if found is not None:
            runs = np.arange(1 << (k if k < d else d))
            signs = [[bin(run & vector).count("1") % 2 for vector in found] for run in runs.tolist()]
            return np.array(signs, dtype=float)
    raise ValueError(
        f"no fraction of d={d} factors at resolution {resolution} with at most 2^{MOST_BASIC} runs was found;"
        " lower the resolution"
    )


def _independent(d: int, k: int, strength: int) -> list[int] | None:
    """d vectors of GF(2)^k, any strength - 1 of them independent; None when not found within NODES tries."""
    if strength >= 4 and d > 1 << (k - 1):
        return None
    # the product of 2 to R - 2 basic factors would be a word that is too short
    heavy = [v for v in range(1, 1 << k) if bin(v).count("1") >= strength - 1]
    if strength == 4:  # resolution IV: all products of an odd number of basic factors will do
        heavy = [v for v in heavy if bin(v).count("1") % 2 == 1]
    chosen = [1 << i for i in range(k)]
    reach = _sums(chosen, strength - 2)
    nodes = 0

    def extend(first: int, reach: set[int]) -> bool:
        nonlocal nodes
        if len(chosen) >= d:
            return True
        for place in range(first, len(heavy)):
            vector = heavy[place]
            nodes += 1
            if nodes > NODES or len(heavy) - place < d - len(chosen):
                return False
            if vector in reach:
                continue
            chosen.append(vector)
            if extend(place + 1, _sums(chosen, strength - 2)):
                return True
            chosen.pop()
        return False

    return chosen[:d] if extend(0, reach) else None


def _sums(vectors: list[int], most: int) -> set[int]:
    """Sums over GF(2) of at most `most` of the vectors."""
    sums = {0}
    layer = {(0, -1)}
    for _ in range(most):
        layer = {(s ^ v, i) for s, last in layer for i, v in enumerate(vectors) if i > last}
        sums |= {s for s, _ in layer}
    return sums


def resolution(points: ArrayLike, *, most: int = 5) -> int:
    """Resolution of a two-level design: the fewest factors whose product is constant; `most` + 1 if more.

    >>> resolution(two_level_fraction(4, resolution=4))
    4

    Raises: ValueError when a column does not hold exactly the two levels 0 and 1.
    """
    array = checked(points)
    if not np.isin(array, (0.0, 1.0)).all():
        raise ValueError("points needs the two levels 0 and 1 only, found others")
    signs = (2 * array - 1).astype(np.int64)
    for size in range(1, min(most, signs.shape[1]) + 1):
        for columns in combinations(range(signs.shape[1]), size):
            if abs(int(signs[:, columns].prod(axis=1).sum())) == len(signs):
                return size
    return most + 1


def plackett_burman(d: int) -> Floats:
    """The smallest Plackett-Burman design for d two-level factors, orthogonal: (n, d).

    n is the next multiple of 4 above d. pyDOE3 has the sizes that follow from 12 and 20 runs by doubling; the
    others come from a Hadamard matrix of Paley 1933.

    >>> plackett_burman(11).shape, plackett_burman(27).shape
    ((12, 11), (28, 27))

    Raises: ValueError when no design of that size is known here.
    """
    if d < 1:
        raise ValueError(f"d needs a whole number of factors >= 1, got {d}")
    from pyDOE3 import pbdesign

    n = 4 * (d // 4 + 1)
    try:
        signs = np.asarray(pbdesign(d), dtype=float)
    except (AssertionError, ValueError):
        hadamard = _paley(n)
        if hadamard is None:
            raise ValueError(
                f"no Plackett-Burman design of {n} runs is known here for d={d} factors; ask for d={n}"
                " and leave the last columns unused"
            ) from None
        signs = hadamard[:, 1 : d + 1]
    _require(len(signs) == n, "Plackett-Burman design", "run count")
    _require(np.isin(signs, (-1.0, 1.0)).all(), "Plackett-Burman design", "two levels")
    _require(not signs.sum(axis=0).any(), "Plackett-Burman design", "balance")
    off = signs.T @ signs - len(signs) * np.eye(d)
    _require(not off.any(), "Plackett-Burman design", "orthogonality")
    return np.ascontiguousarray((signs + 1.0) / 2.0)


def _paley(n: int) -> Floats | None:
    """A Hadamard matrix with first column 1 from quadratic residues (Paley 1933), or None."""

    def conference(q: int) -> Floats | None:
        """Jacobsthal's matrix of a prime q, bordered by ones: (q + 1, q + 1), zero diagonal."""
        if q < 3 or any(q % k == 0 for k in range(2, int(q**0.5) + 1)):
            return None
        squares = {k * k % q for k in range(1, q)}
        chi = np.array([0.0] + [1.0 if k in squares else -1.0 for k in range(1, q)])
        index = np.arange(q)
        s = np.zeros((q + 1, q + 1))
        s[0, 1:] = 1.0
        s[1:, 0] = 1.0 if q % 4 == 1 else -1.0
        s[1:, 1:] = chi[(index[:, None] - index) % q]
        return s

    first = conference(n - 1) if (n - 1) % 4 == 3 else None
    if first is not None:
        matrix: Floats = first + np.eye(n)
    elif n % 4 == 0 and (n // 2 - 1) % 4 == 1 and (second := conference(n // 2 - 1)) is not None:
        matrix = np.kron(second, [[1, 1], [1, -1]]) + np.kron(np.eye(n // 2), [[1, -1], [-1, -1]])
    elif n >= 8 and n % 8 == 0 and (half := _paley(n // 2)) is not None:
        matrix = np.asarray(np.kron([[1, 1], [1, -1]], half), dtype=float)
    else:
        return None
    return np.asarray(matrix * matrix[:, :1])


def central_composite(d: int, *, alpha: str = "rotatable", centre: int = 4) -> Floats:
    """Central composite design: 2^d corners, 2 d axial points, `centre` runs in the middle.

    alpha: rotatable puts the axial points at 2^(d/4) times the corners' coordinate, orthogonal at the
    distance that makes the squares uncorrelated, faced on the faces with the corners at the corners. The
    design is scaled so that its outermost points lie on the bounds.

    >>> central_composite(3).shape
    (18, 3)
    """
    if d < 2:
        raise ValueError(f"d needs at least 2 factors, got {d}")
    if alpha not in ("rotatable", "orthogonal", "faced"):
        raise ValueError(f"alpha needs one of rotatable, orthogonal, faced, got {alpha!r}")
    if centre < 0:
        raise ValueError(f"centre needs a whole number >= 0, got {centre}")
    corners = 1 << d
    if alpha == "orthogonal":
        # squares are uncorrelated when corners + 2 a^2 = sqrt(corners n); Khuri & Cornell 1996, section 4.5
        n = corners + 2 * d + centre
        distance = np.sqrt((np.sqrt(corners * n) - corners) / 2.0)
    else:
        from pyDOE3 import ccdesign

        face = "faced" if alpha == "faced" else "circumscribed"
        theirs = np.asarray(ccdesign(d, center=(0, 0), alpha="rotatable", face=face), dtype=float)
        distance = float(np.abs(theirs).max()) if alpha == "rotatable" else 1.0
        _require(len(theirs) == corners + 2 * d, "central composite design", "run count")
        wanted = 2.0 ** (d / 4.0) if alpha == "rotatable" else 1.0
        _require(abs(distance - wanted) < EXACT, "central composite design", "axial distance")
    cube = 2.0 * np.array(list(product((0.0, 1.0), repeat=d))) - 1.0
    axial = np.repeat(np.eye(d), 2, axis=0) * np.tile([-distance, distance], d)[:, None]
    points = np.vstack([cube, axial, np.zeros((centre, d))])
    return np.ascontiguousarray((points / max(1.0, distance) + 1.0) / 2.0)


def box_behnken(d: int, *, centre: int = 3) -> Floats:
    """Box-Behnken design for 3 to 7 factors: 12, 24, 40, 48, 56 runs and `centre` runs in the middle.

    Blocks of two (d <= 5) or three factors run through their corners while the others stay in the middle; the
    blocks are those of Box & Behnken 1960.

    >>> [len(box_behnken(d, centre=0)) for d in range(3, 8)]
    [12, 24, 40, 48, 56]
    """
    if not 3 <= d <= 7:
        raise ValueError(f"d needs 3 to 7 factors for a Box-Behnken design, got {d}")
    if centre < 0:
        raise ValueError(f"centre needs a whole number >= 0, got {centre}")
    runs = []
    for block in TRIPLES.get(d, tuple(combinations(range(d), 2))):
        for corner in product((0.0, 1.0), repeat=len(block)):
            run = np.full(d, 0.5)
            run[list(block)] = corner
            runs.append(run)
    return np.vstack([*runs, np.full((centre, d), 0.5)])


def orthogonal_array(name: str) -> Floats:
    """One of pyDOE3's Taguchi arrays, such as 'L9(3^4)', levels at k/(N - 1): (runs, factors).

    Handed out only if every column is balanced and every pair of columns holds all combinations equally
    often.

    >>> orthogonal_array("L9(3^4)").shape
    (9, 4)

    Raises: ValueError for an unknown name and for an array that is not orthogonal.
    """
    from pyDOE3 import get_orthogonal_array, list_orthogonal_arrays

    known = list(list_orthogonal_arrays())
    if name not in known:
        raise ValueError(f"name needs one of {', '.join(known)}, got {name!r}")
    codes = np.asarray(get_orthogonal_array(name)).astype(np.int64)
    _require(is_orthogonal(codes), f"array {name}", "pairs of columns")
    codes = codes - codes.min(axis=0)
    return np.ascontiguousarray(codes / codes.max(axis=0))


def is_orthogonal(codes: NDArray[np.int64]) -> bool:
    """Whether all combinations of levels stand equally often in every pair of columns (strength 2)."""
    for a, b in combinations(range(codes.shape[1]), 2):
        counts = np.unique(codes[:, [a, b]], axis=0, return_counts=True)[1]
        cells = len(np.unique(codes[:, a])) * len(np.unique(codes[:, b]))
        if len(counts) != cells or counts.min() != counts.max():
            return False
    return True


def _require(fact: object, design: str, what: str) -> None:
    if not fact:
        raise ValueError(f"the {design} that pyDOE3 made fails the check of its {what}; do not use it")

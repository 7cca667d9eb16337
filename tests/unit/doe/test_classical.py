"""Classical designs: run counts as published, balance, orthogonality, resolution."""

import numpy as np
import pytest

import doe
from doe.classical import is_orthogonal

# published minima of regular two-level fractions (Box, Hunter & Hunter; Draper & Lin 1990 for resolution V)
RUNS = {
    3: {3: 4, 5: 8, 7: 8, 8: 16, 15: 16, 31: 32},
    4: {4: 8, 5: 16, 8: 16, 16: 32},
    5: {5: 16, 6: 32, 7: 64, 8: 64, 11: 128, 17: 256},
    6: {6: 32, 7: 64, 9: 128},
}


@pytest.mark.parametrize(
    ("strength", "d", "runs"), [(r, d, n) for r, row in RUNS.items() for d, n in row.items()]
)
def test_two_level_fractions_take_the_published_number_of_runs(strength, d, runs):
    points = doe.two_level_fraction(d, resolution=strength)
    assert points.shape == (runs, d)
    assert (points.mean(axis=0) == 0.5).all()
    assert len(np.unique(points, axis=0)) == runs
    if runs <= 128:
        assert doe.resolution(points, most=strength) >= strength


@pytest.mark.parametrize(("d", "runs"), [(3, 12), (4, 24), (5, 40), (6, 48), (7, 56)])
def test_box_behnken_designs_are_the_published_ones(d, runs):
    points = doe.box_behnken(d, centre=3)
    assert points.shape == (runs + 3, d)
    assert (np.bincount((2 * points).astype(int).ravel())[[0, 2]] > 0).all()
    moved = (points != 0.5).sum(axis=1)
    assert set(moved.tolist()) == {0, 2 if d <= 5 else 3}
    # every factor varies in the same number of runs, balanced, and all coefficients can be estimated
    assert len(set((points != 0.5).sum(axis=0).tolist())) == 1
    np.testing.assert_allclose(points.mean(axis=0), 0.5)
    x = doe.model_matrix(points, model="quadratic")
    assert np.linalg.matrix_rank(x) == x.shape[1]


def test_box_behnken_blocks_cover_every_pair_of_factors():
    # 7 factors: a balanced incomplete block design, every pair in one block; 6: in one or two
    for d, times in [(6, {1, 2}), (7, {1})]:
        x = doe.box_behnken(d, centre=0) != 0.5
        pairs = (x.T.astype(int) @ x.astype(int))[np.triu_indices(d, 1)] // 8
        assert set(pairs.tolist()) == times


@pytest.mark.parametrize("d", [1, 2, 3, 7, 8, 11, 19, 23, 27, 33, 35, 43, 47, 59])
def test_plackett_burman_designs_are_orthogonal_in_the_next_multiple_of_four(d):
    points = doe.plackett_burman(d)
    assert points.shape == (4 * (d // 4 + 1), d)
    assert doe.d_efficiency(points) == pytest.approx(1.0, abs=1e-12)


def test_central_composite_designs_have_their_distances_and_counts():
    faced = doe.central_composite(3, alpha="faced", centre=2)
    assert faced.shape == (16, 3)
    assert set(np.unique(faced)) == {0.0, 0.5, 1.0}
    round_ = doe.central_composite(4, centre=6)
    radius = np.linalg.norm(round_ - 0.5, axis=1)[:-6]
    np.testing.assert_allclose(radius, radius[0])  # d = 4: corners and axial points on one sphere
    square = 2 * doe.central_composite(3, alpha="orthogonal", centre=4) - 1
    x2 = square**2 - (square**2).mean(axis=0)
    np.testing.assert_allclose((x2.T @ x2)[np.triu_indices(3, 1)], 0, atol=1e-12)


def test_full_factorials_hold_every_combination_once():
    points = doe.full_factorial([2, 3, 4])
    assert points.shape == (24, 3)
    assert len(np.unique(points, axis=0)) == 24
    assert set(points[:, 2]) == {0, 1 / 3, 2 / 3, 1}


@pytest.mark.parametrize(
    ("name", "shape"), [("L9(3^4)", (9, 4)), ("L16(4^5)", (16, 5)), ("L36(3^23)", (36, 23))]
)
def test_orthogonal_arrays_are_balanced_in_pairs(name, shape):
    points = doe.orthogonal_array(name)
    assert points.shape == shape
    codes = np.rint(points * 60).astype(np.int64)
    assert is_orthogonal(codes)
    codes[0, 0] = codes[-1, 0]
    assert not is_orthogonal(codes)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: doe.full_factorial([2, 1]), "levels needs a number >= 2 for every factor"),
        (lambda: doe.two_level_fraction(0), "d needs a whole number of factors >= 1, got 0"),
        (lambda: doe.two_level_fraction(5, resolution=2), "resolution needs a whole number >= 3, got 2"),
        (lambda: doe.two_level_fraction(70_000), "no fraction of d=70000 factors at resolution 3"),
        (lambda: doe.resolution([[0.0], [0.5]]), "points needs the two levels 0 and 1 only"),
        (lambda: doe.plackett_burman(0), "d needs a whole number of factors >= 1, got 0"),
        (lambda: doe.plackett_burman(91), "no Plackett-Burman design of 92 runs is known here for d=91"),
        (lambda: doe.central_composite(1), "d needs at least 2 factors, got 1"),
        (lambda: doe.central_composite(3, alpha="far"), "alpha needs one of rotatable, orthogonal, faced"),
        (lambda: doe.central_composite(3, centre=-1), "centre needs a whole number >= 0, got -1"),
        (lambda: doe.box_behnken(8), "d needs 3 to 7 factors for a Box-Behnken design, got 8"),
        (lambda: doe.box_behnken(4, centre=-2), "centre needs a whole number >= 0, got -2"),
        (lambda: doe.orthogonal_array("L7"), "name needs one of L4"),
        # this array of pyDOE3 1.6 has pairs of columns that are not balanced
        (lambda: doe.orthogonal_array("L64(2^31)"), "fails the check of its pairs of columns"),
    ],
)
def test_bad_input_says_what_to_do(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("d", [3, 4, 5])
def test_box_behnken_designs_equal_those_of_pydoe3_where_that_is_right(d):
    from pyDOE3 import bbdesign

    theirs = {tuple(row) for row in (bbdesign(d, center=1) + 1) / 2}
    assert theirs == {tuple(row) for row in doe.box_behnken(d, centre=1)}

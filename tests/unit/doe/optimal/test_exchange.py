"""Exchange over candidates: local optimality by brute force, forced rows, runs already made, long lists."""

import numpy as np
import pytest

import doe
from doe.criteria.regression import model_matrix, moment_matrix
from doe.optimal import _kernels_exchange as kernels
from doe.optimal.row_search import Task, padded, row_search

# single precision proposes exchanges in the tableau: gains below this may be left
LEFT = 1e-5


def information(points, model, moments, criterion):
    x = model_matrix(points, model=model)
    m = x.T @ x
    if criterion == "D":
        return np.linalg.slogdet(m)[1]
    return -np.log(np.trace(np.linalg.inv(m) @ moments))


@pytest.mark.parametrize("criterion", ["D", "A", "I"])
@pytest.mark.parametrize("replicates", [False, True])
def test_no_single_exchange_improves_the_result(criterion, replicates):
    rng = np.random.default_rng(4)
    candidates = rng.random((40, 2))
    moments = moment_matrix("quadratic", 2) if criterion == "I" else np.eye(6)
    rows = doe.exchange(candidates, 9, model="quadratic", criterion=criterion, replicates=replicates, rng=rng)
    value = information(candidates[rows], "quadratic", moments, criterion)
    for k in range(9):
        for j in range(40):
            if replicates or j not in rows:
                trial = rows.copy()
                trial[k] = j
                assert information(candidates[trial], "quadratic", moments, criterion) <= value + LEFT


@pytest.mark.parametrize("criterion", ["D", "A", "I"])
def test_the_kernels_leave_exact_inverses_behind(criterion):
    rng = np.random.default_rng(8)
    f = padded(model_matrix(rng.random((120, 3)), model="quadratic"))
    moments = moment_matrix("quadratic", 3) if criterion == "I" else np.eye(10)
    task = Task(n=14, terms=10, criterion=criterion, information=np.zeros((10, 10)), moments=moments)
    design = rng.choice(120, 14, replace=False)
    inverse, before = task.inverse(f[design])
    used = np.bincount(design, minlength=120)
    v = np.einsum("ij,ij->i", f @ inverse, f)
    if criterion == "D":
        moves = kernels.climb_d(f, design, used, 0, inverse, v, False, 1000)
    else:
        middle = np.zeros_like(inverse)
        middle[:10, :10] = inverse[:10, :10] @ moments @ inverse[:10, :10]
        c = np.einsum("ij,ij->i", f @ middle, f)
        moves = kernels.climb_trace(f, design, used, 0, inverse, middle, v, c, np.exp(-before), False, 1000)
    exact, after = task.inverse(f[design])
    assert moves > 0
    assert after > before
    np.testing.assert_allclose(inverse, exact, atol=1e-9 * np.abs(exact).max())
    np.testing.assert_allclose(v, np.einsum("ij,ij->i", f @ exact, f), rtol=1e-8)
    if criterion != "D":
        again = exact[:10, :10] @ moments @ exact[:10, :10]
        np.testing.assert_allclose(middle[:10, :10], again, atol=1e-9 * np.abs(again).max())


def test_included_rows_stay_and_runs_already_made_count():
    rng = np.random.default_rng(5)
    candidates = rng.random((60, 2))
    rows = doe.exchange(candidates, 8, include=[3, 7], rng=rng)
    assert {3, 7} <= set(rows.tolist())
    assert len(set(rows.tolist())) == 8
    made = rng.random((5, 2))
    few = doe.exchange(candidates, 1, existing=made, rng=rng)
    gains = [doe.d_efficiency(np.vstack([made, candidates[j : j + 1]]), model="quadratic") for j in range(60)]
    assert int(few[0]) == int(np.argmax(gains))


def test_replicates_are_used_only_when_allowed():
    corners = np.array([[0.0], [0.5], [1.0]])
    rows = doe.exchange(corners, 6, replicates=True, rng=np.random.default_rng(0))
    assert np.bincount(rows).tolist() == [2, 2, 2]
    assert doe.exchange(corners, 3, rng=np.random.default_rng(0)).tolist() == [0, 1, 2]


def test_two_level_grids_give_the_orthogonal_half():
    grid = np.array(np.meshgrid(*[[0.0, 1.0]] * 4)).reshape(4, -1).T
    rows = doe.exchange(grid, 8, model="linear", starts=5, rng=np.random.default_rng(1))
    assert doe.d_efficiency(grid[rows]) == pytest.approx(1.0, abs=1e-12)


def test_a_long_list_is_read_in_blocks_and_beats_a_short_one():
    rng = np.random.default_rng(6)
    long = rng.random((70_000, 3))
    rows = doe.exchange(long, 12, rng=rng)
    short = doe.exchange(long[:2000], 12, rng=rng)
    assert doe.d_efficiency(long[rows], model="quadratic") > doe.d_efficiency(long[short], model="quadratic")
    kept = doe.exchange(long, 12, include=[5, 69_999], rng=rng)
    assert {5, 69_999} <= set(kept.tolist())
    trace = doe.exchange(long, 12, criterion="I", rng=rng)
    assert doe.i_efficiency(long[trace], model="quadratic") > doe.i_efficiency(long[rows], model="quadratic")


def test_more_starts_are_never_worse_and_the_seed_decides():
    candidates = np.random.default_rng(7).random((80, 2))
    one = doe.exchange(candidates, 8, shakes=0, rng=np.random.default_rng(1))
    ten = doe.exchange(candidates, 8, shakes=0, starts=10, rng=np.random.default_rng(1))
    again = doe.exchange(candidates, 8, shakes=0, starts=10, rng=np.random.default_rng(1))
    assert doe.d_efficiency(candidates[ten], model="quadratic") >= doe.d_efficiency(
        candidates[one], model="quadratic"
    )
    np.testing.assert_array_equal(ten, again)


@pytest.mark.parametrize(
    ("levels", "d", "n", "model", "least"),
    [(2, 8, 40, "interactions", 0.847), (3, 6, 36, "quadratic", 0.486)],
)
def test_problems_of_middling_size_get_starts_too(levels, d, n, model, least):
    # with a few starts, as these once got: 0.838 to 0.852 and 0.4835 to 0.4875; with 60 and 46 the least of
    # 20 and 12 seeds are 0.8486 and 0.4866
    axes = np.meshgrid(*[np.linspace(0.0, 1.0, levels)] * d, indexing="ij")
    candidates = np.stack(axes, axis=-1).reshape(-1, d)
    for seed in range(3):
        rows = doe.exchange(candidates, n, model=model, rng=np.random.default_rng(seed))
        assert doe.d_efficiency(candidates[rows], model=model) > least


def test_a_saturated_design_is_shaken_without_losing_its_rank():
    rng = np.random.default_rng(9)
    f = padded(model_matrix(rng.random((200, 2)), model="quadratic"))
    task = Task(n=6, terms=6, information=np.zeros((6, 6)), moments=np.eye(6))
    design, score = row_search(f, task, shakes=50, rng=rng)
    assert np.isfinite(score)
    assert np.linalg.matrix_rank(f[design]) == 6


LINE = np.array([[0.0], [0.0 + 1e-14], [1e-13], [0.5], [1.0]])
GRID = np.array(np.meshgrid([0.0, 1.0], [0.0, 0.5, 1.0])).reshape(2, -1).T


@pytest.mark.parametrize(
    ("candidates", "n", "options", "message"),
    [
        ([[0.1, np.nan]] * 9, 6, {}, "candidates needs finite numbers, row 0 holds NaN"),
        ([[0.1, 0.2]] * 9, 6, {}, "candidates has equal rows 0 and 1"),
        (GRID, 7, {"model": "linear"}, "candidates has 6 rows, fewer than n=7"),
        (GRID, 5, {}, "n=5 runs cannot estimate the 6 terms of the model in 2 factors"),
        (GRID, 6, {}, "candidates can only estimate 5 of the 6 terms"),
        (LINE, 3, {"include": [0, 1, 2]}, "no regular design was found though the candidates can"),
        (GRID, 0, {}, "n needs a whole number of runs >= 1, got 0"),
        (GRID, 4, {"criterion": "E"}, "criterion needs one of D, A, I, got 'E'"),
        (GRID, 4, {"model": "linear", "include": [9]}, "include needs rows of the 6 candidates"),
        (GRID, 4, {"model": "linear", "include": [1, 1]}, "include names a row twice"),
        (GRID, 4, {"model": "linear", "include": [0, 1, 2, 3, 4]}, "include names 5 rows but n=4"),
        (GRID, 4, {"model": "linear", "starts": 0}, "starts needs a number >= 1 and shakes >= 0"),
        (GRID, 4, {"model": "linear", "existing": [[0.5]]}, "existing needs the 2 columns"),
        (np.zeros((0, 2)), 4, {}, r"candidates needs shape \(runs, factors\)"),
    ],
)
def test_bad_input_says_what_to_do(candidates, n, options, message):
    with pytest.raises(ValueError, match=message):
        doe.exchange(candidates, n, rng=np.random.default_rng(0), **options)


def test_long_lists_that_cannot_estimate_the_model_are_refused():
    points = np.random.default_rng(0).random((9000, 2))
    points[:, 1] = np.where(np.arange(9000) % 2, 0.0, 1.0)
    with pytest.raises(ValueError, match="can only estimate 5 of the 6 terms"):
        doe.exchange(points, 8, rng=np.random.default_rng(0))

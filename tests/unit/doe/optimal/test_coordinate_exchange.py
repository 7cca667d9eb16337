"""Coordinate exchange: continuous, discrete and mixed levels, three criteria."""

import numpy as np
import pytest

import doe
from doe.criteria.regression import model_matrix, model_terms
from doe.optimal.coordinate_exchange import _derivative


@pytest.mark.parametrize(("criterion", "own"), [("D", 0), ("A", 1), ("I", 2)])
def test_each_criterion_is_best_at_its_own_figure(criterion, own):
    measures = (doe.d_efficiency, doe.a_efficiency, doe.i_efficiency)
    designs = {
        c: doe.coordinate_exchange(9, 2, criterion=c, rng=np.random.default_rng(2)) for c in ("D", "A", "I")
    }
    figures = {c: measures[own](x, model="quadratic") for c, x in designs.items()}
    assert figures[criterion] == max(figures.values())


@pytest.mark.parametrize("criterion", ["D", "A", "I"])
def test_no_single_coordinate_improves_a_design_on_levels(criterion):
    measure = {"D": doe.d_efficiency, "A": doe.a_efficiency, "I": doe.i_efficiency}[criterion]
    points = doe.coordinate_exchange(11, 2, criterion=criterion, levels=4, rng=np.random.default_rng(3))
    value = measure(points, model="quadratic")
    for i in range(11):
        for c in range(2):
            for level in np.linspace(0, 1, 4):
                trial = points.copy()
                trial[i, c] = level
                assert measure(trial, model="quadratic") <= value * (1 + 1e-8)


def test_mixed_levels_are_kept_and_the_square_of_a_two_level_factor_left_out():
    points = doe.coordinate_exchange(14, 3, levels=[2, None, [0.0, 0.3, 1.0]], rng=np.random.default_rng(1))
    assert set(points[:, 0]) == {0.0, 1.0}
    assert set(points[:, 2]) <= {0.0, 0.3, 1.0}
    terms = np.delete(model_terms("quadratic", 3), 7, axis=0)
    assert doe.d_efficiency(points, model=terms) > 0.3


def test_runs_already_made_are_filled_up():
    made = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    points = doe.coordinate_exchange(1, 2, model="linear", existing=made, rng=np.random.default_rng(1))
    np.testing.assert_allclose(points, [[1.0, 1.0]], atol=1e-9)


def test_the_polish_never_hurts():
    rough = doe.coordinate_exchange(10, 3, polish=False, rng=np.random.default_rng(5))
    fine = doe.coordinate_exchange(10, 3, rng=np.random.default_rng(5))
    assert doe.d_efficiency(fine, model="quadratic") > doe.d_efficiency(rough, model="quadratic")


def test_derivatives_of_model_rows_agree_with_complex_steps():
    coded = np.random.default_rng(0).random((4, 3)) * 2 - 1
    terms = np.vstack([model_terms("quadratic", 3), [3, 1, 0]])
    for c in range(3):
        step = coded.copy()
        step[:, c] += 1e-6
        back = coded.copy()
        back[:, c] -= 1e-6
        difference = (
            model_matrix((step + 1) / 2, model=terms) - model_matrix((back + 1) / 2, model=terms)
        ) / 2e-6
        np.testing.assert_allclose(_derivative(coded, terms, c), difference, atol=1e-8)


@pytest.mark.parametrize(
    ("n", "d", "options", "message"),
    [
        (0, 2, {}, "n and d need whole numbers >= 1, got n=0 and d=2"),
        (5, 2, {}, "n=5 runs cannot estimate the 6 terms of the model in 2 factors"),
        (9, 2, {"criterion": "G"}, "criterion needs one of D, A, I"),
        (9, 2, {"starts": 0}, "starts needs a whole number >= 1"),
        (9, 2, {"levels": [3]}, "levels needs one entry for each of the 2 factors, got 1"),
        (9, 2, {"levels": 1}, "levels of factor 0 needs at least 2, got 1"),
        (9, 2, {"levels": [[0.5], 3]}, r"levels of factor 0 needs two or more values in \[0, 1\]"),
        (9, 2, {"model": [[0, 0], [3, 0]], "levels": [[0.5, 1], 3]}, None),
        (9, 1, {"model": [[0], [1], [2]], "levels": 2}, "no design of n=9 runs on these levels was found"),
        (9, 2, {"model": lambda x: x}, "model needs a name or a table of exponents here"),
        (9, 2, {"existing": [[0.1]]}, "existing needs 2 columns, got 1"),
    ],
)
def test_bad_input_says_what_to_do(n, d, options, message):
    if message is None:
        assert doe.coordinate_exchange(n, d, rng=np.random.default_rng(0), **options).shape == (n, d)
        return
    with pytest.raises(ValueError, match=message):
        doe.coordinate_exchange(n, d, rng=np.random.default_rng(0), **options)

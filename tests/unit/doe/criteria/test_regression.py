"""Models and efficiencies against closed forms and plain formulas."""

import numpy as np
import pytest

import doe.criteria.regression as models

# plain linear algebra on the same matrix in another order
ROUNDING = 1e-10


def test_the_quadratic_model_has_its_terms():
    for d, p in [(1, 3), (2, 6), (8, 45), (10, 66), (20, 231)]:
        assert models.model_terms("quadratic", d).shape == (p, d)


def test_model_rows_are_products_of_coded_columns():
    rng = np.random.default_rng(3)
    u = rng.random((7, 3))
    x = 2 * u - 1
    expected = np.column_stack([np.ones(7), x, x[:, 0] * x[:, 1], x[:, 0] * x[:, 2], x[:, 1] * x[:, 2], x**2])
    np.testing.assert_allclose(models.model_matrix(u, model="quadratic"), expected, atol=ROUNDING)


def test_custom_models_are_exponents_or_functions():
    u = np.random.default_rng(1).random((5, 2))
    table = [[0, 0], [3, 0], [1, 2]]
    x = 2 * u - 1
    expected = np.column_stack([np.ones(5), x[:, 0] ** 3, x[:, 0] * x[:, 1] ** 2])
    np.testing.assert_allclose(models.model_matrix(u, model=table), expected, atol=ROUNDING)
    got = models.model_matrix(u, model=lambda c: np.column_stack([np.ones(len(c)), np.sin(c[:, 0])]))
    np.testing.assert_allclose(got[:, 1], np.sin(x[:, 0]), atol=ROUNDING)


def test_efficiencies_of_a_two_level_factorial_are_one():
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    for efficiency in (models.d_efficiency, models.a_efficiency, models.g_efficiency):
        assert efficiency(corners, model="interactions") == pytest.approx(1.0, abs=ROUNDING)
    np.testing.assert_allclose(models.variance_inflation(corners, model="interactions"), 1.0)


def test_efficiencies_follow_their_definitions():
    u = np.random.default_rng(5).random((20, 3))
    x = models.model_matrix(u, model="quadratic")
    inverse = np.linalg.inv(x.T @ x)
    n, p = x.shape
    assert models.d_efficiency(u, model="quadratic") == pytest.approx(
        np.linalg.det(x.T @ x) ** (1 / p) / n, rel=1e-9
    )
    assert models.a_efficiency(u, model="quadratic") == pytest.approx(p / (n * np.trace(inverse)), rel=1e-9)
    moments = models.moment_matrix("quadratic", 3)
    expected = p / (n * np.trace(inverse @ moments))
    assert models.i_efficiency(u, model="quadratic") == pytest.approx(expected, rel=1e-9)
    worst = models.model_matrix(np.random.default_rng(6).random((20_000, 3)), model="quadratic")
    seen = (worst @ inverse * worst).sum(axis=1).max()
    assert models.g_efficiency(u, model="quadratic") <= p / (n * seen)


def test_moments_agree_with_the_mean_over_many_points():
    exact = models.moment_matrix("quadratic", 3)
    sampled = models.moment_matrix(lambda x: models.model_matrix((x + 1) / 2, model="quadratic"), 3)
    np.testing.assert_allclose(exact, sampled, atol=5e-3)  # 4096 Sobol' points


def test_inflation_is_one_over_one_minus_r_squared_and_infinite_when_dependent():
    rng = np.random.default_rng(2)
    u = rng.random((15, 3))
    x = np.column_stack([np.ones(15), u[:, 1:]])
    residual = u[:, 0] - x @ np.linalg.lstsq(x, u[:, 0], rcond=None)[0]
    expected = np.sum((u[:, 0] - u[:, 0].mean()) ** 2) / np.sum(residual**2)
    assert models.variance_inflation(u)[0] == pytest.approx(expected, rel=1e-9)
    u[:, 1] = u[:, 0]
    np.testing.assert_array_equal(np.isinf(models.variance_inflation(u)), [True, True, False])
    u[:, 1] = 0.3
    np.testing.assert_array_equal(np.isinf(models.variance_inflation(u)), [False, True, False])


def test_a_design_that_cannot_estimate_its_model_has_efficiency_zero():
    few = np.random.default_rng(0).random((4, 3))
    flat = np.full((12, 2), 0.5)
    for efficiency in (models.d_efficiency, models.a_efficiency, models.i_efficiency, models.g_efficiency):
        assert efficiency(few, model="quadratic") == 0.0
        assert efficiency(flat) == 0.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: models.model_terms("cubic", 2), "model needs one of linear, interactions, quadratic"),
        (lambda: models.model_terms("linear", 0), "d needs a whole number of factors >= 1, got 0"),
        (lambda: models.model_terms([[1, 0]], 3), r"needs shape \(terms, 3\), got \(1, 2\)"),
        (lambda: models.model_terms([[0.5, 0]], 2), "needs whole numbers >= 0"),
        (lambda: models.model_terms([[1, 0], [1, 0]], 2), "needs each term once"),
        (lambda: models.model_matrix([0.1, 0.2]), r"points needs shape \(runs, factors\)"),
        (lambda: models.model_matrix([[0.1], [np.nan]]), "row 1 holds NaN or infinity"),
        (
            lambda: models.model_matrix([[0.1]], model=lambda x: np.ones(3)),
            "model as a function needs finite",
        ),
    ],
)
def test_bad_input_says_what_to_do(call, message):
    with pytest.raises(ValueError, match=message):
        call()

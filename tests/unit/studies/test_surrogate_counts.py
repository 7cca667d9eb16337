"""The counts of decisions 0198 and 0250: known indices are found, and each count counts."""

import numpy as np
import pytest

from studies.surrogate_counts import (
    BANDS,
    FUNCTIONS,
    averaged_indices,
    bands,
    carried,
    decades,
    ishigami,
    kriging,
    main,
    sobol_g,
    true_indices,
)


def test_functions_take_as_many_inputs_as_the_table_says():
    for d, n, f in FUNCTIONS.values():
        y = f(np.random.default_rng(0).random((n, d)))
        assert y.shape == (n,)
        assert np.isfinite(y).all()


def test_true_indices_are_those_of_closed_forms():
    alone, total = true_indices(ishigami, 3)
    assert alone == pytest.approx([0.3139, 0.4424, 0.0], abs=5e-3)
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=5e-3)
    variances = 1 / (3 * (1 + np.array([0.0, 1.0, 4.5, 9.0])) ** 2)
    alone, _ = true_indices(sobol_g, 4)
    assert alone == pytest.approx(variances / (np.prod(1 + variances) - 1), abs=5e-3)


def test_true_indices_of_a_response_over_decades():
    rates = np.array([4.0, -3.0, 1.0])
    r = np.expm1(2 * rates) / (2 * rates) / (np.expm1(rates) / rates) ** 2 - 1
    whole = np.prod(1 + r) - 1
    alone, total = averaged_indices(lambda x: np.exp(x @ rates), 3)
    assert alone == pytest.approx(r / whole, abs=1e-3)
    assert total == pytest.approx(r * np.prod(1 + r) / (1 + r) / whole, abs=1e-3)


@pytest.mark.slow
def test_intervals_bands_and_lists_are_counted(capsys):
    held, error = kriging(1, 1, ["friedman"])["friedman"]
    assert 0.7 < held <= 1.0
    assert 0.3 < error < 1.3
    inside, of, width = bands(1, 1, ["branin"])["branin"]
    assert of == 2 * BANDS["branin"][0]
    assert 2 <= inside <= of
    assert 0.0 < width < 1.0
    rows = list(decades(7, 1))
    assert [row["noise"] for row in rows] == [0.0, 0.05]
    assert all(0.0 <= row["x"] <= 1.0 and (row["beyond"] > row["x"]).all() for row in rows)


@pytest.mark.slow
@pytest.mark.count
def test_bands_over_decades_are_counted():
    rows = list(carried(5, 1))
    assert [row["decades"] for row in rows] == [2, 3]
    assert all(0 <= row[name]["held"] <= 2 * row["inputs"] for row in rows for name in ("none", "auto"))
    assert all(row["auto"]["error"] <= row["none"]["error"] for row in rows)


def test_a_count_that_is_not_there_is_named():
    with pytest.raises(SystemExit, match="counts are kriging, bands, carried, decades, got errors"):
        main("errors", 1, 1)

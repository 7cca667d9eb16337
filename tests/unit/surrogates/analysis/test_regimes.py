"""Two regimes of a response are told from one law with whatever tail."""

import numpy as np
import pytest

from surrogates.analysis.regimes import find_regimes

# laws that had no part in the table of critical values, and laws that had
LAWS = {
    "normal": lambda rng, n: rng.standard_normal(n),
    "lognormal": lambda rng, n: np.exp(rng.standard_normal(n)),
    "uniform": lambda rng, n: rng.random(n),
    "exponential": lambda rng, n: rng.standard_exponential(n),
    "size of Cauchy": lambda rng, n: np.abs(rng.standard_cauchy(n)),
    "Pareto 1.5": lambda rng, n: rng.pareto(1.5, n),
    "Weibull 0.7": lambda rng, n: rng.weibull(0.7, n),
    "logistic": lambda rng, n: rng.logistic(size=n),
    "a wave of three uniform inputs": lambda rng, n: np.sin(rng.random((n, 3)) @ np.array([4.0, 2.0, 1.0])),
}
SAMPLES, FALSE = 60, 0.02  # of all samples; the table allows 0.01 for each law


def switching(rng, n, share=0.3):
    gone = rng.random(n) < share
    return gone, np.where(gone, 7.9 + 3.3 * rng.random(n), 0.02 + 0.38 * rng.random(n))


def test_one_law_is_hardly_ever_taken_for_two():
    rng = np.random.default_rng(11)
    count = total = 0
    for n in (20, 35, 60, 120, 200):
        for law in LAWS.values():
            count += sum(find_regimes(law(rng, n)) is not None for _ in range(SAMPLES))
            total += SAMPLES
    assert count <= FALSE * total, (count, total)


@pytest.mark.parametrize("n", [30, 60, 120])
def test_a_switch_is_found_with_the_right_runs(n):
    found = 0
    for seed in range(20):
        gone, y = switching(np.random.default_rng(seed), n)
        regimes = find_regimes(y)
        if regimes is not None:
            found += 1
            assert regimes.is_upper.tolist() == gone.tolist()
            assert regimes.lower[1] < regimes.threshold < regimes.upper[0]
            assert regimes.gap >= regimes.critical
    assert found >= 18


def test_a_switch_over_decades_shows_in_the_logarithm():
    rng = np.random.default_rng(0)
    y = np.exp(np.concatenate([rng.normal(-7.0, 0.6, 40), rng.normal(3.0, 0.9, 20)]))
    regimes = find_regimes(y)
    assert regimes is not None
    assert regimes.is_upper.sum() == 20


def test_its_unit_and_sense_do_not_matter():
    gone, y = switching(np.random.default_rng(3), 60)
    scaled, turned = find_regimes(1e-6 * y - 4.0), find_regimes(-y)
    assert scaled is not None
    assert turned is not None
    assert scaled.is_upper.tolist() == gone.tolist()
    assert turned.is_upper.tolist() == (~gone).tolist()


def test_a_regime_of_one_value_counts_and_a_count_does_not():
    rng = np.random.default_rng(5)
    y = np.where(rng.random(60) < 0.5, 0.0, 5.0 + rng.random(60))
    assert find_regimes(y) is not None
    assert find_regimes(rng.integers(0, 3, 60).astype(float)) is None
    assert find_regimes(np.ones(60)) is None
    assert find_regimes(y[:19]) is None


def test_values_that_are_none_are_refused():
    with pytest.raises(ValueError, match=r"regimes need finite responses \(n,\), got shape \(2,\) with nan"):
        find_regimes([1.0, float("nan")])

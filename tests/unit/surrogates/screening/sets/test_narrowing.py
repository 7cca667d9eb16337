"""The search in two widths: numbering comes back right, and what acts is among the promising units."""

import numpy as np
import pytest

from surrogates import KrigingScreener, restricted_log_likelihood
from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.landscape import landscape_of
from surrogates.screening.sets.multi_start import merged, multi_start
from surrogates.screening.sets.narrowing import (
    MOST,
    narrowed,
    promising,
    widened,
)
from surrogates.screening.sets.single_input_fits import margins

BOUNDS = (1e-4, 10.0)
SAME = 1e-8  # sums over groups in another order


def wide_runs(seed=0, n=90, d=60):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    y = np.sin(5 * x[:, 7]) + 2 * x[:, 30] * x[:, 44] + x[:, 51] ** 2
    return x, y


def search(landscape, number):
    return multi_start(
        landscape,
        number=number,
        nuggets=(1e-4,),
        nugget=BOUNDS,
        enough=number,
        fewest=number,
        patience=number,
        price=4.0,
        rng=np.random.default_rng(1),
    )


def test_maxima_of_the_narrow_landscape_are_points_of_the_wide_one():
    x, y = wide_runs()
    runs = canonical_runs(x, y)
    ground = landscape_of(runs)
    first = search(ground, 8)
    units = promising(ground, first, margins(runs))
    assert len(units) <= MOST
    acting = {i for i, k in enumerate(runs.columns) if k in (7, 30, 44, 51)}
    assert acting <= set(units)
    close = search(narrowed(ground, units), 6)
    back = widened(close, units)
    for narrow, wide in zip(close.optima, back.optima, strict=True):
        assert ground.value(wide.partition, wide.phi) == pytest.approx(narrow.value, abs=SAME, rel=SAME)
        assert {u for group in wide.partition for u in group} == set(units)
    both = merged(first, back, price=4.0, landscape=ground)
    assert both.starts == 14
    assert len(both.optima) == len(first.optima) + len(back.optima)
    assert both.evaluations == first.evaluations + close.evaluations


def test_sixty_inputs_with_runs_few_and_many():
    for n in (90, 160):
        x, y = wide_runs(3, n=n)
        screener = KrigingScreener().fit(x, y)
        assert set(screener.ranking_[:4]) == {7, 30, 44, 51}
        again = KrigingScreener().fit(x[::-1, ::-1], y[::-1])
        assert [59 - k for k in again.selected_] == list(screener.selected_)


@pytest.mark.slow
@pytest.mark.parametrize("n", [300, 700])
def test_large_designs_end_on_all_runs(n):
    """The path states the likelihood of all runs, and what only all of them show is taken in."""
    rng = np.random.default_rng(8)
    x = rng.random((n, 6))
    y = np.sin(5 * x[:, 2]) + x[:, 4] + 0.11 * x[:, 0] + 0.1 * rng.standard_normal(n)
    screener = KrigingScreener().fit(x, y)
    # the third has half a percent of the variance
    assert set(screener.selected_) | set(screener.minor_) == {0, 2, 4}
    assert screener.diagnosis_.search_runs == 130
    for step in screener.path_:
        l = restricted_log_likelihood(step.theta, step.sigma2, x, y, nugget=step.nugget)
        assert step.log_likelihood == pytest.approx(l, abs=1e-5)
    assert screener.nugget_ * screener.sigma2_ == pytest.approx(0.01, rel=0.25)


def test_margins_name_parabolas_and_labels_and_no_pure_interactions():
    rng = np.random.default_rng(4)
    x = rng.random((400, 6))
    x[:, 3] = rng.integers(0, 3, 400)
    y = 4 * (x[:, 0] - 0.5) ** 2 + (x[:, 3] == 1.0) + 8 * (x[:, 1] - 0.5) * (x[:, 2] - 0.5)
    runs = canonical_runs(x, y, labels=(3,))
    share = {runs.given(u)[0]: r2 for u, r2 in enumerate(margins(runs))}
    assert share[0] > 0.1
    assert share[3] > 0.1
    assert max(share[k] for k in (1, 2, 4, 5)) < 0.05
    assert share[0] == pytest.approx(
        np.corrcoef(y, np.polyval(np.polyfit(x[:, 0], y, 3), x[:, 0]))[0, 1] ** 2
    )

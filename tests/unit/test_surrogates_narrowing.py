"""The search in two widths: numbering comes back right, and what acts is among the promising units."""

import numpy as np
import pytest

from surrogates import KrigingScreener
from surrogates.canonical import canonical_runs
from surrogates.landscape import landscape_of
from surrogates.narrowing import MOST, narrowed, promising, widened
from surrogates.search import merged, multi_start

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
    units = promising(ground, first)
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

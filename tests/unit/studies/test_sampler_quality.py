"""The sampler study: its asserted number, its table and its figures."""

import numpy as np

from studies import sampler_quality


def test_the_published_ihs_crosses_the_random_law_between_eight_and_twelve_factors():
    ds = sampler_quality.run(3, sizes=((20, 4),), dimensions=(4, 8, 12, 20), repeats=3)
    ratio = ds.nearest.sel(curve="IHS published") / ds.nearest.sel(curve="random LHS")
    # helps for few factors, hurts for many: 0.8 at 50 x 20
    assert float(ratio.sel(d=4)) > 1.15
    assert float(ratio.sel(d=12)) < 0.95
    np.testing.assert_allclose(float(ratio.sel(d=20)), 0.81, atol=0.04)
    auto = ds.nearest.sel(curve="IHS auto") / ds.nearest.sel(curve="random LHS")
    assert (auto > 1.0).all()
    best = ds.quality.sel(size="20x4", metric="phi_p")
    assert str(best.idxmin("sampler").item()) == "phi_p swaps"

    text = sampler_quality.table(ds)
    assert max(map(len, text.splitlines())) <= 85
    assert "IHS auto" in text
    assert set(sampler_quality.figures(ds)) == {"nearest", "criteria"}

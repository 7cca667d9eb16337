"""What laws of restraints give back."""

import pytest

from studies.restraint_laws import figures, run


def test_elastic_laws_give_all_back_and_the_others_little():
    ds = run()
    share = {str(law): float(ds.given_back.sel(law=law) / ds.put_in.sel(law=law)) for law in ds.law.values}
    for name in ("belt (8.26)", "airbag (8.27)"):
        assert share[name] == pytest.approx(1.0, abs=1e-5)
        assert float(ds.rebound.sel(law=name)) == pytest.approx(1.0, abs=2e-3)
    assert share["airbag, vented"] < 0.04
    assert float(ds.rebound.sel(law="airbag, vented")) == pytest.approx(0.097, abs=2e-3)  # of 1 m/s
    assert all(share[name] < 0.2 for name in share if "webbing" in name or "reel" in name)
    assert len(figures(ds)["restraint_laws"].axes) == len(ds.law)

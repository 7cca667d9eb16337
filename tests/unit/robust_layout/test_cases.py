"""Layouts for given cases are made once."""

import numpy as np

from tests.sample_layout import TwoMembers
from workbench.robust_layout import cases as cases_of
from workbench.robust_layout.cases import Optimised, optimise_for_cases


def test_a_layout_is_found_again_whatever_the_order_of_a_cases_parameters(tmp_path, monkeypatch):
    """A case that an attack found has another order once it was read from the attack's file."""
    made = []
    real = cases_of.optimise_layout
    monkeypatch.setattr(cases_of, "optimise_layout", lambda *a, **o: made.append(1) or real(*a, **o))

    def layout(*cases):
        found = optimise_for_cases(
            TwoMembers(), cases, start=None, folder=tmp_path, evaluations=5, identity="two"
        )
        assert isinstance(found, Optimised)
        return found.density

    first = layout({"u": 1.0, "v": 0.0}, {"u": -1.0, "v": 0.5})
    again = layout({"v": 0.0, "u": 1.0}, {"v": 0.5, "u": -1.0})
    assert np.array_equal(first, again)
    assert len(made) == 1
    layout({"u": 1.0, "v": 0.1}, {"u": -1.0, "v": 0.5})
    assert len(made) == 2

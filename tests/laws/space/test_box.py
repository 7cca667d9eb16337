"""What holds for every space: physical and unit coordinates are inverse, values stay inside their bounds."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from workbench.space.box import Parameter, Space

ROUNDING = 1e-9  # of the unit interval; both directions are a handful of float operations

bounded = st.floats(-1e6, 1e6)


@st.composite
def parameters(draw, name="p"):
    kind = draw(
        st.sampled_from(["continuous", "log", "step", "integer", "discrete", "binary", "categorical"])
    )
    if kind == "integer":
        low = draw(st.integers(-1000, 1000))
        return Parameter(name, kind=kind, lower=low, upper=low + draw(st.integers(1, 500)))
    if kind == "discrete":
        return Parameter(
            name, kind=kind, levels=tuple(draw(st.lists(bounded, min_size=2, max_size=9, unique=True)))
        )
    if kind == "categorical":
        return Parameter(
            name,
            kind=kind,
            levels=tuple(draw(st.lists(st.text("abcde"), min_size=2, max_size=9, unique=True))),
        )
    if kind == "binary":
        return Parameter(name, kind=kind)
    low = draw(bounded)
    width = draw(st.floats(1e-3, 1e6))
    if kind == "step":
        step = draw(st.integers(1, 1000)) / 8
        low = round(low)
        return Parameter(name, lower=low, upper=low + draw(st.integers(1, 200)) * step, step=step)
    if kind == "log":
        return Parameter(name, lower=abs(low) + 1e-3, upper=abs(low) + 1e-3 + width, scale="log")
    return Parameter(name, lower=low, upper=low + width)


@given(parameters(), st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_there_and_back(p, us):
    space = Space([p])
    u = np.array(us)[:, None]
    there = space.rows(u)
    back = space.unit(there)
    assert np.all((back >= 0) & (back <= 1))
    if p.levels_count is None:
        # a value next to its bound has a coordinate known to rounding of the value itself
        size = max(abs(p.lower), abs(p.upper)) / (p.upper - p.lower)
        assert np.max(np.abs(back - u)) <= ROUNDING * max(size, 1)
    else:
        assert np.array_equal(back, space.snap(u))
        assert space.rows(back) == there
    if p.lower is not None:
        assert all(p.lower <= row["p"] <= p.upper for row in there)


@given(parameters())
def test_dictionaries_carry_everything(p):
    space = Space([p])
    assert Space.from_dict(space.to_dict()) == space

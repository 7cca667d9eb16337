"""What holds for every design over every space: bounds, balance, constraints, identities."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.sampling.plan import Design, DesignOptions, make_design
from workbench.space.box import Parameter, Space

CASES = settings(max_examples=10, deadline=None)


@st.composite
def spaces(draw):
    parameters = []
    for k in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["continuous", "integer", "discrete", "binary", "categorical", "step"]))
        name = f"x{k}"
        if kind == "continuous":
            parameters.append(Parameter(name, lower=1.0, upper=draw(st.floats(1.5, 1e6)), scale="log"))
        elif kind == "integer":
            parameters.append(Parameter(name, lower=0, upper=draw(st.integers(1, 20)), kind="integer"))
        elif kind == "discrete":
            count = draw(st.integers(2, 6))
            parameters.append(
                Parameter(name, kind="discrete", levels=tuple(float(2**i) for i in range(count)))
            )
        elif kind == "binary":
            parameters.append(Parameter(name, kind="binary"))
        elif kind == "categorical":
            parameters.append(
                Parameter(name, kind="categorical", levels=tuple("abcd"[: draw(st.integers(2, 4))]))
            )
        else:
            parameters.append(Parameter(name, lower=0.0, upper=7.0 * draw(st.integers(1, 60)), step=7.0))
    return Space(parameters)


@CASES
@given(
    space=spaces(),
    kind=st.sampled_from(["lhs", "ihs", "sobol", "optimised_lhs"]),
    runs=st.integers(1, 25),
    seed=st.integers(0, 1000),
)
def test_levels_are_balanced_and_physical_values_come_back(space, kind, runs, seed):
    options = DesignOptions(swaps=200) if kind == "optimised_lhs" else None
    design = make_design(space, kind, runs, seed=seed, options=options)
    np.testing.assert_array_equal(space.unit(design.rows()).round(9), design.unit.round(9))
    for p, column in zip(space.parameters, design.unit.T, strict=True):
        if p.levels_count is not None:
            levels = np.rint(column * (p.levels_count - 1)).astype(int)
            counts = np.bincount(levels, minlength=p.levels_count)
            assert counts.max() - counts.min() <= 1
        elif kind != "sobol":
            assert sorted(np.floor(column * runs).astype(int)) == list(range(runs))
    again = Design.from_dict(design.to_dict())
    np.testing.assert_array_equal(again.unit, design.unit)


@pytest.mark.slow
@CASES
@given(
    bound=st.floats(0.3, 1.9),
    runs=st.integers(1, 20),
    kind=st.sampled_from(["lhs", "sobol", "d_optimal_select"]),
)
def test_a_constraint_is_met_by_every_run_whatever_it_leaves(bound, runs, kind):
    runs = max(runs, 3)
    parameters = [Parameter(name, lower=0, upper=1) for name in "ab"]
    space = Space(parameters, (f"a + b <= {bound}",))
    design = make_design(space, kind, runs, seed=1)
    assert len(design) == runs
    assert space.feasible(design.unit).all()


@pytest.mark.slow
@CASES
@given(runs=st.integers(2, 20), times=st.integers(1, 3), more=st.integers(1, 10), seed=st.integers(0, 100))
def test_ids_are_different_and_stay_with_their_points(runs, times, more, seed):
    space = Space([Parameter(name, lower=0, upper=1) for name in "ab"])
    first = make_design(space, "lhs", runs, seed=seed)
    later = first.randomised(seed=seed).replicated(times).grown(more, seed=seed)
    assert len(set(later.run_ids)) == len(later) == runs * times + more
    place = {name: k for k, name in enumerate(later.run_ids)}
    for name, point in zip(first.run_ids, first.unit, strict=True):
        np.testing.assert_array_equal(later.unit[place[name]], point)

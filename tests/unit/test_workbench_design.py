"""Designs with names, units, identities and provenance."""

import numpy as np
import pytest

from workbench.design import Design, DesignOptions, make_design
from workbench.errors import StudyError
from workbench.space import Parameter, Space


@pytest.fixture
def space():
    return Space(
        [Parameter("a", lower=0, upper=2, unit="m"), Parameter("n", kind="integer", lower=1, upper=4)]
    )


@pytest.mark.parametrize("kind", ["sobol", "halton", "d_optimal_select"])
def test_a_kind_gives_the_runs_asked_for_inside_the_bounds(space, kind):
    design = make_design(space, kind, 12, seed=3)
    assert len(design) == 12
    frame = design.to_pandas()
    assert frame["a"].between(0, 2).all()
    assert set(frame["n"]) <= {1, 2, 3, 4}
    np.testing.assert_array_equal(make_design(space, kind, 12, seed=3).unit, design.unit)


def test_a_grid_takes_all_levels_and_even_steps(space):
    design = make_design(space, "grid", None, options=DesignOptions(levels=3))
    assert len(design) == 12
    assert sorted(set(design.to_pandas()["a"])) == [0, 1, 2]


def test_tables_carry_units_identities_and_provenance(space):
    design = make_design(space, "sobol", 5, seed=7)
    dataset = design.to_xarray()
    assert dataset["a"].attrs["units"] == "m"
    assert list(dataset["run"].values) == ["r0001", "r0002", "r0003", "r0004", "r0005"]
    assert dataset.attrs["seed"] == 7
    assert dataset.attrs["space_hash"] == space.hash
    assert design.to_pandas().attrs["units"] == {"a": "m", "n": "1"}
    document = design.to_dict()
    assert document["n"] == 5
    assert document["d"] == 2
    assert document["parameters"][0]["unit"] == "m"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: make_design(s, "hypercube", 5), "design kind needs one of lhs, .*got 'hypercube'"),
        (lambda s: make_design(s, "sobol", 0), "design kind 'sobol' needs runs >= 1, got 0"),
        (lambda s: make_design(s, "lhs", 5, options=DesignOptions(pool=50)), "'lhs' does not take 'pool'"),
        (lambda s: make_design(s, "grid", None), "'grid' needs levels"),
        (lambda s: Design(space=s, unit=[[0, 0]], run_ids=(), algorithm="x"), "one run id per run, got 0"),
        (lambda s: Design(space=s, unit=[[0, 0]] * 2, run_ids=("a", "a"), algorithm="x"), "given twice"),
    ],
)
def test_bad_input_says_what_to_do(space, call, message):
    with pytest.raises(StudyError, match=message):
        call(space)

"""The runs of a design to make first: spread nearly as well as their number allows, and the rest later."""

import numpy as np
import pytest

import doe
from workbench.errors import StudyError
from workbench.sampling.kinds import checked_up_to
from workbench.sampling.parts import first_part, leading_rows, next_part
from workbench.sampling.plan import make_design
from workbench.space.box import Distribution, Parameter, Space

SPACE = Space([Parameter(f"x{k}", lower=0, upper=1) for k in range(4)])


def test_the_first_part_is_far_more_even_than_the_rows_as_they_come():
    whole = make_design(SPACE, "optimised_lhs", 60, seed=41)
    part, later = first_part(whole, 40)
    rng = np.random.default_rng(1)
    others = [whole.unit[rng.permutation(60)[:40]] for _ in range(20)]
    assert part.run_ids[-1] == "r0040"
    # random parts of such designs have 2 to 5 times the CD2 of the part chosen; none of 20 comes near
    assert doe.cd2(part.unit) < 0.6 * min(doe.cd2(points) for points in others)
    assert doe.phi_p(part.unit) < np.median([doe.phi_p(points) for points in others])
    assert doe.max_correlation(part.unit) < min(doe.max_correlation(points) for points in others)
    together = np.vstack([part.unit, later])
    assert sorted(together.tolist()) == sorted(whole.unit.tolist())


def test_the_parts_after_it_make_up_the_whole():
    whole = make_design(SPACE, "optimised_lhs", 30, seed=42)
    part, later = first_part(whole, 12)
    more, left = next_part(part, later, 8, seed=42)
    assert (len(more), len(left)) == (20, 10)
    np.testing.assert_array_equal(more.unit[:12], part.unit)
    assert doe.cd2(more.unit) < doe.cd2(np.vstack([part.unit, later[:8]]))
    done, left = next_part(more, left, 10, seed=42)
    assert left == []
    assert done.run_ids == tuple(f"r{k:04d}" for k in range(1, 31))
    assert sorted(done.unit.tolist()) == sorted(whole.unit.tolist())


def test_an_exchange_is_judged_by_the_criteria_of_the_part():
    """The tables, whole numbers up to 2^30, say of a part what `doe` says of its points."""
    from workbench.sampling.parts import _Tables

    unit = make_design(SPACE, "lhs", 20, seed=43).unit
    tables = _Tables(unit, 8)
    rng = np.random.default_rng(2)
    for _ in range(5):
        inside = np.zeros(20, bool)
        inside[rng.permutation(20)[:8]] = True
        sums = tables.pairs[:, inside][:, :, inside].sum(axis=(1, 2))
        merit = tables.merit(sums[:, None], tables.singles[inside].sum()[None], 1e6)[0]
        points = unit[inside]
        distances = np.linalg.norm(points[:, None] - points, axis=2)[np.triu_indices(8, 1)]
        near = np.linalg.norm(unit[:, None] - unit, axis=2)[np.triu_indices(20, 1)].min()
        spread = (2.0 * ((near / distances) ** 10).sum() * 2.0**30 / 1e6) ** 0.125
        z = points - 0.5
        gram = z.T @ z
        square = ((gram**2).sum() - (np.diag(gram) ** 2).sum()) / (12 * (8 / 12) ** 2)
        expected = spread + doe.cd2(points) / (doe.cd2(unit) * 20 / 8) + 2.0 * square**0.5
        assert merit == pytest.approx(expected, rel=1e-5)


def test_a_part_follows_a_distribution():
    space = Space([Parameter("v", distribution=Distribution("norm", {"loc": 10.0, "scale": 2.0}))])
    whole = make_design(space, "optimised_lhs", 60, seed=1)
    part, _ = first_part(whole, 20)
    assert abs(part.unit.mean() - whole.unit.mean()) < 0.01
    assert abs(part.unit.std() - whole.unit.std()) < 0.01


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "optimal", "runs": 10, "up_to": 20}, r"up_to goes with kinds that fill the space \(lhs, "),
        ({"kind": "lhs", "runs": 10, "up_to": 9}, "up_to needs runs or more, at most 2000; got 9, runs = 10"),
        ({"kind": "lhs", "runs": 10, "up_to": 2001}, "at most 2000; got 2001, runs = 10"),
        ({"kind": "lhs", "up_to": 20}, "got 20, runs = None"),
    ],
)
def test_what_cannot_be_drawn_for_later_is_refused(table, message):
    with pytest.raises(StudyError, match=message):
        checked_up_to(table)
    assert checked_up_to({"kind": "lhs", "runs": 10}) is None


def test_a_part_needs_a_size_that_there_is():
    with pytest.raises(ValueError, match="a part needs kept <= k <= 5 runs, got kept = 0 and k = 6"):
        leading_rows(np.zeros((5, 1)), 6, rng=np.random.default_rng(1))

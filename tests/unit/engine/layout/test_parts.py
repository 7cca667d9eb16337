"""Layouts in parts: who is open, off and kept; the whole beside them."""

from dataclasses import replace

import numpy as np
import pytest

from studies.layouts_in_parts import BELTS, decompositions, problem
from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem
from workbench.engine.layout.parts import Part, optimise_in_parts

W = np.array([1.0, 4.0, 9.0])


def bowl(start=0.3, **options):
    return static_problem(
        lambda a: (float((W / (0.1 + a)).sum()), -W / (0.1 + a) ** 2),
        start=np.full(3, start), budgets=[(np.ones(3), 1.0)], **options,
    )  # fmt: skip


def test_others_are_off_or_as_the_parts_before_have_left_them():
    seen = []

    def watched(a):
        seen.append(a.copy())
        return float((W / (0.1 + a)).sum()), -W / (0.1 + a) ** 2

    own = static_problem(watched, start=np.full(3, 0.3), budgets=[(np.ones(3), 1.5)])
    whole = replace(bowl(), limits=np.array([1.5]))
    parts = [Part(name="one", variables=[0], problem=own), Part(name="two", variables=[1], problem=own)]
    found = optimise_in_parts(whole, parts, max_evaluations=8)
    first = [a for a in seen if a[1] == 0.0]
    assert all(a[2] == 0.0 for a in seen)  # nobody opens it
    assert found.density[0] == pytest.approx(1.0)
    second = seen[len(first) :]
    assert found.density[1] == pytest.approx(0.5)  # what the first has left
    assert all(a[0] == pytest.approx(1.0) for a in second)
    seen.clear()
    apart = [Part(name=p.name, variables=p.variables, problem=own, others="off") for p in parts]
    both = optimise_in_parts(whole, apart, max_evaluations=8)
    assert all(min(a[0], a[1]) == 0.0 for a in seen)
    # each took what it could: together they break the budget, and the record says so
    assert both.excess == pytest.approx(1 / 3)


def test_at_once_from_the_parts_is_the_optimum_and_parts_have_a_price():
    parts = [Part(name="a", variables=[0, 1]), Part(name="b", variables=[2])]
    found = optimise_in_parts(bowl(), parts, max_evaluations=20, at_once=60, rounds=2)
    assert found.at_once is not None
    assert found.price_of_parts > 0.1
    assert found.evaluations == sum(p.evaluations for p in found.parts) + 1 + found.at_once.evaluations
    assert len(found.parts) == 4
    assert np.isnan(optimise_in_parts(bowl(), parts, max_evaluations=5).price_of_parts)
    e = 1e-4
    for i in range(3):
        for j in range(3):
            moved = found.at_once.density + e * (np.eye(3)[i] - np.eye(3)[j])
            assert bowl().evaluate(moved).values.max() >= found.at_once.value * (1 - 1e-6)


def test_parts_that_cannot_be_are_refused():
    with pytest.raises(InvalidLayout, match=r"'b' needs design variables .* got 0, open in 'a'"):
        optimise_in_parts(bowl(), [Part(name="a", variables=[0]), Part(name="b", variables=[0])])
    with pytest.raises(InvalidLayout, match="opens no design variable"):
        optimise_in_parts(bowl(), [Part(name="a", variables=[])])
    small = problem(1)
    with pytest.raises(InvalidLayout, match="has 34"):
        optimise_in_parts(bowl(), [Part(name="a", variables=[0], problem=small)])


@pytest.mark.slow
def test_the_three_ways_of_chapter_eight_run_and_at_once_is_no_worse():
    one = problem(3)
    for some in decompositions(3).values():
        found = optimise_in_parts(one, some, max_evaluations=12, at_once=30)
        assert found.excess <= 1e-9
        assert found.at_once is not None
        assert found.at_once.value <= found.value * (1 + 1e-9)
        # belts of the parts did not see what fires later
        assert found.parts[0].density[:BELTS].sum() <= 0.25 * BELTS + 1e-9

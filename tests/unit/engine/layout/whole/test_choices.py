"""What may be chosen: groups, counts, budgets, exclusions, twins."""

import itertools

import numpy as np
import pytest

from workbench.engine.layout.formulation.problem import InvalidLayout, MemberGeometry, static_problem
from workbench.engine.layout.whole.choices import choices, twins


def problem(members=6, **options):
    return static_problem(
        lambda a: (float((1 / (0.1 + a)).sum()), -1 / (0.1 + a) ** 2), start=np.full(members, 0.3), **options
    )


def test_everything_allowed_is_found_and_nothing_else():
    open_ = choices(
        problem(budgets=[(np.array([3.0, 1, 1, 1, 1, 1]), 4.0)]),
        3,
        groups=[[4, 5]],
        forbidden=[(1, 2)],
        always=[3],
    )
    found = {tuple(np.flatnonzero(on @ open_.table)) for on in open_.everything(at_most=1000)}
    expected = set()
    for k in range(4):
        for on in itertools.combinations(range(6), k):
            cost = len(on) + (2 if 0 in on else 0)
            if 3 in on and cost <= 4 and (4 in on) == (5 in on) and not (1 in on and 2 in on):
                expected.add(on)
    assert found == expected
    assert open_.everything(at_most=len(expected) - 1) is None


def test_steps_beside_a_choice_are_allowed_and_one_step_away():
    open_ = choices(problem(), 2)
    on = np.array([True, True, False, False, False, False])
    beside = open_.beside(on)
    assert len(beside) == 2 + 2 * 4  # two drops, eight swaps; a third member is one too many
    assert all(open_.allowed(other) for other in beside)
    assert (open_.density(on) == [1, 1, 0, 0, 0, 0]).all()


def test_twins_are_found_by_their_ends_bodies_and_kind():
    a = np.zeros((5, 3))
    b = np.array([[1.0, 0, 0.3], [1, 0, -0.3], [1, 0, 0.3], [0, 1, 0], [1, 0, 0]])
    geometry = MemberGeometry(
        body_a=np.zeros(5, int), point_a=a, body_b=np.array([1, 1, 2, 1, 1]), point_b=b,
        kind=("belt", "belt", "belt", "belt", "bag"),
    )  # fmt: skip
    assert twins(geometry) == [[0, 1]]
    assert twins(geometry, axes=(0, 1, 2)) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"groups": [[0, 1], [1, 2]]}, "each in one group; got 1 in"),
        ({"groups": [[7]]}, "groups need free members from 0 to 5"),
        ({"always": [6]}, "always and forbidden need free members from 0 to 5, got 6"),
        ({"always": [0, 1, 2]}, "got count=2 and 3 members that are always on"),
        ({"always": [0, 1], "forbidden": [(0, 1)]}, "without forbidden pairs"),
    ],
)
def test_what_cannot_be_chosen_is_refused(options, message):
    with pytest.raises(InvalidLayout, match=message):
        choices(problem(), 2, **options)

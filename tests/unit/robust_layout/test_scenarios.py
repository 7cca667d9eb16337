"""The set that a loop begins with: equal shares of every combination of words, corners first."""

from collections import Counter

import numpy as np
import pytest

from workbench.robust_layout.scenarios import stratified_cases
from workbench.space.box import Space
from workbench.space.parameter import Parameter

SPACE = Space(
    (
        Parameter("hands", kind="categorical", levels=("none", "one", "both")),
        Parameter("seat", kind="categorical", levels=("soft", "hard")),
        *(Parameter(f"k{j}", lower=0.5, upper=2.0) for j in range(12)),
    )
)


def numbers(cases):
    return np.array([[case[f"k{j}"] for j in range(12)] for case in cases])


@pytest.mark.parametrize("number", [24, 48])
def test_every_combination_of_words_has_its_share_of_corners_and_of_cases_inside(number):
    cases = stratified_cases(SPACE, number, seed=3)
    assert len(cases) == number
    ends = np.isin(numbers(cases), (0.5, 2.0)).all(axis=1)
    assert ends.sum() == 0.75 * number
    assert not np.isin(numbers(cases)[~ends], (0.5, 2.0)).any()
    for part, share in ((ends, 0.75 * number / 6), (~ends, 0.25 * number / 6)):
        counts = Counter((c["hands"], c["seat"]) for c, of in zip(cases, part, strict=True) if of)
        assert set(counts.values()) == {share}


def test_the_set_is_a_function_of_the_seed():
    assert stratified_cases(SPACE, 12, seed=1) == stratified_cases(SPACE, 12, seed=1)
    assert stratified_cases(SPACE, 12, seed=1) != stratified_cases(SPACE, 12, seed=2)
    assert stratified_cases(SPACE, 0, seed=1) == []


def test_constraints_hold_and_few_corners_are_all_taken():
    space = Space((Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)), ("a + b <= 1.5",))
    cases = stratified_cases(space, 16, seed=0)
    assert all(c["a"] + c["b"] <= 1.5 for c in cases)
    corners = [c for c in cases if {c["a"], c["b"]} <= {0.0, 1.0}]
    assert len(corners) == 3  # of four, one is refused

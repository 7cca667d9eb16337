"""Cliffs in corners of a combination of levels whose values are low everywhere else."""

import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.evidence.attack.adversary import attack

DIMENSION, HELD, DEPTH = 13, 8, 0.06
LEVELS = ("one", "two", "three")


def hidden(seed, *, against):
    """A linear response over 13 numbers and a word, and its cliff: eight numbers within 6 % of given ends,
    and not the worst word. At `against` of the ends the linear response is the smaller one."""
    rng = np.random.default_rng([seed, 7])
    slopes = rng.normal(size=DIMENSION) * np.exp(rng.normal(size=DIMENSION))
    slopes /= np.abs(slopes).sum()
    held = rng.choice(DIMENSION, HELD, replace=False)
    ends = (slopes > 0).astype(float)
    ends[held[:against]] = 1.0 - ends[held[:against]]
    offset = dict(zip(LEVELS, rng.permutation([0.0, 0.1, 0.2]), strict=True))
    word = sorted(offset, key=offset.__getitem__)[seed % 2]

    def response(c, **numbers):
        u = np.array([numbers[f"x{j}"] for j in range(DIMENSION)])
        is_over = c == word and (np.abs(u[held] - ends[held]) < DEPTH).all()
        return 1.0 + slopes @ u + offset[c] + (10.0 if is_over else 0.0)

    numbers = [Parameter(f"x{j}", lower=0, upper=1) for j in range(DIMENSION)]
    return response, Space((*numbers, Parameter("c", kind="categorical", levels=LEVELS)))


@pytest.mark.parametrize(("budget", "against", "least"), [(300, 0, 10), (300, 1, 9), (1500, 2, 9)])
def test_a_cliff_is_found_behind_a_small_loss_in_a_combination_of_low_values(budget, against, least):
    """With 300 runs, and one number at the wrong end, climbs that left for a worse word found 5 of 40."""
    found = 0
    for seed in range(100, 110):
        response, space = hidden(seed, against=against)
        record = attack(FunctionEvaluator(response), space, value=2.0, budget=budget, seed=seed)
        found += record.largest > 5.0
    assert found >= least

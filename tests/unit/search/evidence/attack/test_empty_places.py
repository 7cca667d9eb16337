"""Where an adversary looks once its climbs repeat each other."""

import numpy as np

from workbench.search.evidence.attack.empty_places import emptiest


def test_the_emptiest_places_are_those_of_a_greedy_maximin():
    rng = np.random.default_rng(3)
    candidates, known = rng.random((60, 3)), rng.random((10, 3))
    run = list(known)
    for i in emptiest(candidates, known, 8):
        distances = [min(np.linalg.norm(c - k) for k in run) for c in candidates]
        assert distances[i] == max(distances)
        run.append(candidates[i])


def test_no_more_places_than_candidates():
    assert sorted(emptiest(np.array([[0.2], [0.7]]), np.array([[0.0]]), 5)) == [0, 1]

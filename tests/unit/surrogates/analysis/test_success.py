"""The chance that a run succeeds."""

import numpy as np

from surrogates.analysis.success import SuccessChance


def _log_loss(chance, ok):
    p = np.clip(chance, 1e-3, 1 - 1e-3)
    return -np.mean(np.where(ok, np.log(p), np.log(1 - p)))


def test_without_a_failure_every_run_is_taken_to_succeed():
    u = np.random.default_rng(0).random((6, 3))
    assert SuccessChance.of(u, np.ones(6, dtype=bool)).probability(u).tolist() == [1.0] * 6
    assert SuccessChance.of(u, np.zeros(6, dtype=bool)).probability(u).tolist() == [0.5] * 6


def test_runs_are_on_their_own_side():
    u = np.random.default_rng(1).random((30, 4))
    ok = u.sum(axis=1) < 2.2
    chance = SuccessChance.of(u, ok).probability(u)
    assert ((chance > 0.5) == ok).all()


def test_a_plane_is_learnt_in_many_inputs_from_few_runs():
    rng = np.random.default_rng(2)
    u, asked = rng.random((40, 10)), rng.random((2000, 10))
    weights = rng.uniform(0.3, 1.0, 10)
    limit = 0.5 * weights.sum()
    chance = SuccessChance.of(u, u @ weights < limit).probability(asked)
    truth = asked @ weights < limit
    assert np.mean((chance > 0.5) == truth) > 0.75  # by chance 0.5
    assert _log_loss(chance, truth) < 0.8 * np.log(2)


def test_a_pocket_of_failures_is_no_plane():
    rng = np.random.default_rng(3)
    u, asked = rng.random((60, 2)), rng.random((2000, 2))

    def ok(points):
        return np.linalg.norm(points - 0.5, axis=1) > 0.3

    chance = SuccessChance.of(u, ok(u)).probability(asked)
    assert np.mean((chance > 0.5) == ok(asked)) > 0.9


def test_chances_are_calibrated():
    rng = np.random.default_rng(4)
    said, came = [], []
    for _ in range(40):
        weights = rng.normal(size=4)
        limit = 0.5 * weights.sum() + 0.4 * rng.normal()
        u, asked = rng.random((20, 4)), rng.random((200, 4))
        said.append(SuccessChance.of(u, u @ weights < limit).probability(asked))
        came.append(asked @ weights < limit)
    p, ok = np.concatenate(said), np.concatenate(came)
    near = (p > 0.5) & (p < 0.75)
    assert near.sum() > 300
    assert abs(ok[near].mean() - p[near].mean()) < 0.1  # 40 borders: a standard error of about 0.03

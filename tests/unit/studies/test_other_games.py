"""Minimax games of five families, against the true worst of their designs."""

import numpy as np
import pytest

from studies.other_games import FAMILIES, game, run
from studies.two_peak_games import FALSE


@pytest.mark.parametrize("number", range(len(FAMILIES)))
def test_the_true_worst_is_that_of_the_scenarios(number):
    """No scenario of an even sample goes beyond it, and the worst of the sample comes near."""
    for played in (game(number), game(number + len(FAMILIES))):
        rng = np.random.default_rng(number)
        x, u = rng.random(played.dx), rng.random((20_000, played.du))
        found = max(float(played.values(x, u, k).max()) for k in range(max(len(played.labels), 1)))
        worst = played.worst(x)
        assert found <= worst + 1e-9
        assert found > 0.96 * worst


def test_named_scenarios_give_the_values_of_their_label():
    played = game(4)
    assert played.uncertainty.names[-1] == "road"
    x, u = np.full(played.dx, 0.3), np.full(played.du, 0.7)
    named = {f"u{i + 1}": 0.7 for i in range(played.du)}
    for k, label in enumerate(played.labels):
        value = played({f"x{i + 1}": 0.3 for i in range(played.dx)}, {**named, "road": label})
        assert np.isclose(value, played.values(x, u[None], k)[0])


def test_a_cliff_is_stepped_up_where_its_edge_is_passed():
    """The exact worst jumps between designs, as the values do, where no scenario is beyond the edge."""
    played = game(1)
    at = np.linspace(0, 1, 50)[:, None] * np.ones(played.dx)
    rng = np.random.default_rng(0)
    u = np.vstack([rng.random((4000, played.du)), rng.integers(0, 2, (200, played.du))])
    for x in at:
        assert played.worst(x) >= played.values(x, u, 0).max() - 1e-9


@pytest.mark.slow
def test_no_claim_of_a_few_games_is_false():
    found = run((0, 1, 2), (5,))
    claims = found["claims"].values > 0
    assert claims.any()
    assert float(found["short"].values[claims].max()) <= FALSE

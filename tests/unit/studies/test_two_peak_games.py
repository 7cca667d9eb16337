"""Minimax values of games with two peaks, against the true worst of their own designs."""

import numpy as np
import pytest

from studies.two_peak_games import FALSE, game, run


def test_the_true_worst_is_no_less_than_any_scenario():
    for number in (0, 4, 8):
        played = game(number)
        rng = np.random.default_rng(number)
        x = rng.random(len(played.best))
        u = rng.random((20_000, played.centres.shape[1]))
        values = played.values(x, u)
        worst = played.worst(x)
        assert values.max() <= worst + 1e-9
        assert values.max() > 0.98 * worst
        named = {f"u{i + 1}": value for i, value in enumerate(u[0])}
        assert np.isclose(played({f"x{i + 1}": v for i, v in enumerate(x)}, named), values[0])


def test_both_peaks_stand_in_the_box():
    for number in range(30):
        played = game(number)
        assert played.widths[1] < played.widths[0]
        assert ((played.tops(played.best) >= 0) & (played.tops(played.best) <= 1)).all()


@pytest.mark.slow
def test_no_claim_of_the_small_games_is_false():
    """Numbers 4 and 17 were called attacked 1.8 and 9.6 % under the true worst: their narrow peak was known
    at other designs, and the last attack climbed the broad one alone."""
    found = run((0, 1, 3, 4, 9, 17))
    claims = found["claims"].values > 0
    assert claims.sum() >= 3
    assert float(found["short"].values[claims].max()) <= FALSE

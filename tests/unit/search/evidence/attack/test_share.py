import json
from dataclasses import asdict

import numpy as np
import pytest
from scipy.stats import binom

from workbench.search.evidence.attack.share import counted_share


def test_no_hit_is_the_rule_of_three():
    for draws in (10, 100, 3000):
        share = counted_share(0, draws)
        assert share.low == 0
        assert share.high == pytest.approx(1 - 0.05 ** (1 / draws))
        assert share.high < 3 / draws


def test_ends_are_those_of_the_binomial_law():
    share = counted_share(7, 50)
    # at the ends the count seen, or a more extreme one, has a chance of 2.5 %
    assert binom.cdf(7, 50, share.high) == pytest.approx(0.025)
    assert binom.sf(6, 50, share.low) == pytest.approx(0.025)


def test_nothing_is_known_without_a_draw():
    assert (counted_share(0, 0).low, counted_share(0, 0).high) == (0.0, 1.0)


def test_all_hits_leave_the_upper_end_open():
    assert counted_share(5, 5).high == 1.0
    assert counted_share(5, 5).low == pytest.approx(0.05**0.2)


@pytest.mark.parametrize("p", [0.003, 0.05, 0.4])
def test_intervals_cover_at_least_what_they_say(p):
    rng = np.random.default_rng(3)
    shares = [counted_share(int(k), 120) for k in rng.binomial(120, p, 2000)]
    assert np.mean([s.low <= p <= s.high for s in shares]) >= 0.94  # 0.95 less two standard errors


def test_more_hits_than_draws_are_refused():
    with pytest.raises(ValueError, match="hits needs a number between 0 and draws=3, got 4"):
        counted_share(4, 3)


def test_counts_of_arrays_are_written_as_numbers():
    """A model may answer in numpy's numbers, and what counts them is kept as JSON."""
    hits = sum(np.array([0.5, 1.5]) > 1.0)
    assert json.loads(json.dumps(asdict(counted_share(hits, np.int64(2)))))["hits"] == 1

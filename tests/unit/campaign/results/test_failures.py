"""Where runs fail: the best cut of a parameter, as trying every threshold finds it, and of very many runs."""

import random
from itertools import pairwise

import pytest

from workbench.campaign.results.failures import Cut, where_runs_fail
from workbench.models.stored.evaluation import Evaluation
from workbench.space.box import Parameter, Space


def ended(status, x):
    """A run that ended so at a value of the parameter x."""
    return Evaluation(
        id=1, key="k", status=status, attempt=1, batch="design", inputs={"x": x}, outputs={}, gradients={},
        error="", log="", created=0.0, started=0.0, finished=1.0, wall=1.0, cpu=1.0, host=None, seed=1,
    )  # fmt: skip


def tried(bad, good, *, numeric):
    """Every side of every threshold halfway between neighbouring values, or every level, one by one."""
    levels = sorted({*bad, *good})
    sides = [("is", level) for level in levels]
    if numeric:
        middles = [(a + b) / 2 for a, b in pairwise(levels)]
        sides = [(side, t) for t in middles or levels for side in ("above", "below")]
    beyond = {
        "above": lambda v, t: v > t,
        "below": lambda v, t: v < t,
        "is": lambda v, t: v == t,
    }
    cuts = [
        Cut(
            parameter="x",
            side=side,
            threshold=threshold,
            failed_beyond=sum(beyond[side](v, threshold) for v in bad),
            failed=len(bad),
            good_beyond=sum(beyond[side](v, threshold) for v in good),
            good=len(good),
        )
        for side, threshold in sides
    ]
    return max(cuts, key=lambda cut: cut.score)


@pytest.mark.parametrize("distinct", [1, 2, 5, 1000])
@pytest.mark.parametrize("numeric", [True, False])
def test_the_best_cut_is_that_of_all_thresholds(distinct, numeric):
    rng = random.Random(distinct)
    levels = [f"level {k}" for k in range(distinct + 1)]
    x = Parameter("x", lower=-1, upper=1001) if numeric else Parameter("x", kind="categorical", levels=levels)
    for _ in range(30):
        drawn = [rng.randint(1, distinct) for _ in range(rng.randint(6, 40))]
        values = [k / 7 for k in drawn] if numeric else [levels[k] for k in drawn]
        bad, good = values[:4], values[4:]
        runs = [*(ended("failed", v) for v in bad), *(ended("ok", v) for v in good)]
        assert where_runs_fail(runs, Space([x])) == [tried(bad, good, numeric=numeric)]


def test_very_many_runs_take_no_longer_than_their_sorting():
    rng = random.Random(3)
    runs = [ended("failed" if v > 0.9 else "ok", v) for v in (rng.random() for _ in range(50_000))]
    (cut,) = where_runs_fail(runs, Space([Parameter("x", lower=0, upper=1)]))  # hours, every one tried
    assert (cut.side, cut.score) == ("above", 1.0)
    assert cut.threshold == pytest.approx(0.9, abs=1e-3)

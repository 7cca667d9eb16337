"""What is said to be left to gain, against searches over all cases."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.left_to_gain import Left, left_to_gain
from studies.loop_rivals import Runs
from tests.sample_layout import TwoMembers, value

CASES = [{"u": -1.0, "v": 0.0}, {"u": 1.0, "v": 0.0}]


def returned(density, **document):
    """A loop whose layout has these densities."""
    return SimpleNamespace(
        robust="round 1", layouts={"round 1": np.array(density)}, cases=CASES, document=document,
        bound=max(value(density, **case) for case in CASES),
    )  # fmt: skip


@pytest.mark.parametrize(("said", "holds"), [(0.9, True), (0.01, False), (None, False)])
def test_a_layout_far_from_the_optimum_gains_what_is_there(said, holds):
    """The best for both ends makes them equal."""
    far = returned([0.9, 0.1], kkt=said)
    best = min(max(value((a, 1 - a), **case) for case in CASES) for a in np.linspace(0, 1, 10001))
    left = left_to_gain(TwoMembers(), far, Runs(TwoMembers()), evaluations=60, seed=1)
    assert left.gained == pytest.approx(1 - best / far.bound, abs=2e-3)
    assert left.said == said
    assert left.holds is holds


def test_an_optimum_gains_nothing():
    a = min(np.linspace(0, 1, 10001), key=lambda a: max(value((a, 1 - a), **case) for case in CASES))
    left = left_to_gain(
        TwoMembers(), returned([a, 1 - a], kkt=1e-3), Runs(TwoMembers()), evaluations=60, seed=1
    )
    assert 0.0 <= left.gained < 1e-3
    assert left == Left(said=1e-3, gained=left.gained)

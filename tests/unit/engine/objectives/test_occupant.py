"""Occupant measures behind filters: pulses of known value, and slopes against differences of whole runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.sample_trees import one_set_of_kernels, random_tree, tree_run
from workbench.engine import (
    ChannelFilter,
    ClipLevel,
    Coordinate,
    Filtered,
    HeadInjury,
    Maximum,
    NotSupported,
    PointAcceleration,
    RideComfort,
)
from workbench.engine.integration.schemes import GeneralisedAlpha
from workbench.engine.objectives.occupant import Given
from workbench.engine.sensitivity.discrete_adjoint import discrete_adjoint

__all__ = ["one_set_of_kernels"]

SCHEME = GeneralisedAlpha(tolerance=1e-15)
TIMES = np.linspace(0.0, 0.06, 121)
DIFFERENCES = 1e-7
G = 9.80665


def test_m1_and_m2_hold_behind_the_filter_of_a_head():
    """100 g for 10 ms: 1000 and 100 g; CFC 1000 rounds the corners only."""
    times = np.arange(0.0, 0.1, 1e-5)
    inside = (times > 0.03 - 1e-9) & (times < 0.04 + 1e-9)
    run, pulse = SimpleNamespace(times=times), Given(series=np.where(inside, 100.0 * G, 0.0))
    head, chest = HeadInjury(quantity=pulse), ClipLevel(quantity=pulse)
    assert head.value(run) == pytest.approx(1000.0, rel=1e-3)
    assert chest.value(run) == pytest.approx(100.0 * G, rel=1e-3)
    behind = Filtered(objective=head, filter=ChannelFilter(cfc=1000.0))
    assert behind.value(run) == pytest.approx(1000.0, rel=0.02)
    assert Filtered(objective=chest, filter=ChannelFilter(cfc=180.0)).value(run) == pytest.approx(
        100.0 * G, rel=0.05
    )


A = PointAcceleration(body="b3", point=(0.1, 0.2, -0.1), gravity=(0.0, 0.0, -9.81))
MEASURES = {
    "head": Filtered(objective=HeadInjury(quantity=A), filter=ChannelFilter(cfc=60.0)),
    "chest": Filtered(objective=ClipLevel(quantity=A), filter=ChannelFilter(cfc=60.0)),
    "peak": Filtered(
        objective=Maximum(quantity=Coordinate(bodies=("b3",), direction=(0.3, -0.5, 0.8))),
        filter=ChannelFilter(cfc=60.0),
    ),
    "ride": RideComfort(acceleration=A, factors=(1.4, 1.4, 1.0)),
    "ride, a part": RideComfort(acceleration=A, window=(0.02, 0.05)),
}


@pytest.mark.parametrize("measure", MEASURES)
def test_slopes_are_those_of_differences_of_whole_runs(measure):
    rng = np.random.default_rng(11)
    system, objective = random_tree(rng, count=5), MEASURES[measure]
    density, aim = rng.uniform(0.5, 1.0, 12), rng.normal(size=12)
    run = tree_run(system, density, TIMES, SCHEME)
    found = discrete_adjoint(run, objective) @ aim

    def value(e):
        return objective.value(tree_run(system, density + e * aim, TIMES, SCHEME, keep=False))

    h = 1e-4
    expected = (8.0 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12.0 * h)
    assert found == pytest.approx(expected, rel=DIFFERENCES, abs=1e-11 * abs(value(0.0)) / h)
    assert abs(expected) > 1e-6 * abs(value(0.0))


def test_filtered_samples_say_what_they_have_not():
    samples = Given(series=np.zeros(3))
    with pytest.raises(NotSupported, match="filtered samples have no rates"):
        samples.rates(None, np.zeros(1, int))
    with pytest.raises(NotSupported, match="filtered samples have no rates"):
        samples.rate_slopes(None, 0)
    with pytest.raises(NotSupported, match="filtered samples depend on many nodes"):
        samples.slopes(None, 0)

"""Injury measures of pulses with known answers, and their slopes along runs of a tree."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.sample_trees import one_set_of_kernels, random_tree, tree_run
from workbench.engine.errors import NotSupported
from workbench.engine.integration.schemes import GeneralisedAlpha
from workbench.engine.objectives.injury import (
    STANDARD_GRAVITY,
    ClipLevel,
    HeadInjury,
    PointAcceleration,
)
from workbench.engine.sensitivity.discrete_adjoint import discrete_adjoint

__all__ = ["one_set_of_kernels"]


@dataclass(frozen=True)
class Given:
    """Values as they are."""

    series: np.ndarray

    def values(self, trajectory):
        return self.series


def pulse(step=1e-4):
    """100 g for 10 ms."""
    times = np.arange(0.0, 0.1, step)
    inside = (times > 0.03 - 1e-9) & (times < 0.04 + 1e-9)
    return SimpleNamespace(times=times), Given(np.where(inside, 100.0 * STANDARD_GRAVITY, 0.0))


@pytest.mark.parametrize("duration", [0.015, 0.036])
def test_a_rectangular_pulse_of_100_g_and_10_ms_has_a_criterion_of_1000(duration):
    run, quantity = pulse()
    assert HeadInjury(quantity=quantity, duration=duration).value(run) == pytest.approx(1000.0, rel=1e-3)


def test_its_clip_level_is_100_g():
    run, quantity = pulse()
    assert ClipLevel(quantity=quantity).value(run) == pytest.approx(100.0 * STANDARD_GRAVITY)


def test_a_triangle_exceeds_its_clip_level_for_3_ms():
    times = np.arange(0.0, 0.1, 1e-4)
    quantity = Given(np.maximum(0.0, 1.0 - np.abs(times - 0.05) / 0.02))
    # 3 ms wide at 1 - 0.0015/0.02
    assert ClipLevel(quantity=quantity).value(SimpleNamespace(times=times)) == pytest.approx(0.925, abs=3e-3)


@pytest.mark.parametrize("objective", [HeadInjury, ClipLevel])
def test_slopes_through_a_run_are_those_of_differences(objective):
    rng = np.random.default_rng(2)
    system, density = random_tree(rng, count=5, first=0), rng.uniform(0.5, 1.0, 12)
    times, scheme = np.linspace(0.0, 0.02, 41), GeneralisedAlpha(tolerance=1e-15)
    quantity = PointAcceleration(body="b3", point=(0.1, 0.2, 0.3), gravity=(0.0, 0.0, -9.81))
    measure = objective(quantity=quantity, duration=0.004)
    run, aim = tree_run(system, density, times, scheme), rng.normal(size=12)

    def value(e):
        return measure.value(tree_run(system, density + e * aim, times, scheme, keep=False))

    e = 1e-4
    expected = (8.0 * (value(e) - value(-e)) - (value(2 * e) - value(-2 * e))) / (12.0 * e)
    assert discrete_adjoint(run, measure) @ aim == pytest.approx(expected, rel=1e-6)


def test_the_acceleration_of_a_point_is_that_of_its_path():
    rng = np.random.default_rng(5)
    run = tree_run(random_tree(rng, count=5, first=0), np.full(12, 0.5), np.linspace(0.0, 0.02, 401))
    place = run.of("b3", (0.1, 0.2, 0.3))
    h = run.step
    path = (place[2:] - 2.0 * place[1:-1] + place[:-2]) / h**2
    found = PointAcceleration(body="b3", point=(0.1, 0.2, 0.3)).values(run)[1:-1]
    assert found[5:] == pytest.approx(np.linalg.norm(path, axis=1)[5:], rel=5e-3)


def test_what_cannot_be_measured_is_refused():
    run, quantity = pulse(step=0.02)
    with pytest.raises(ValueError, match=r"head injury needs steps within 0\.015 s"):
        HeadInjury(quantity=quantity).value(run)
    with pytest.raises(ValueError, match="clip level needs steps shorter"):
        ClipLevel(quantity=replace(quantity)).value(run)
    acceleration = PointAcceleration(body="head")
    with pytest.raises(NotSupported, match="looks at bodies of a TreeSystem"):
        acceleration.components(run)
    with pytest.raises(NotSupported, match="no rates"):
        acceleration.rates(run, np.arange(1))
    with pytest.raises(NotSupported, match="no rates"):
        acceleration.rate_slopes(run, 0)

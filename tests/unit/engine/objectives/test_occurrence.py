"""Smooth peaks, first crossings, states and speeds seen from a body: known values, and slopes along runs."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from tests.sample_trees import one_set_of_kernels, random_tree, tree_run
from workbench.engine import (
    Coordinate,
    FirstCrossing,
    GeneralisedAlpha,
    LogSumExp,
    PNorm,
    RelativeSpeed,
    State,
)
from workbench.engine.errors import NotSupported
from workbench.engine.sensitivity.discrete_adjoint import discrete_adjoint

__all__ = ["one_set_of_kernels"]

TIMES, SCHEME = np.linspace(0.0, 0.02, 41), GeneralisedAlpha(tolerance=1e-15)
HEIGHT = Coordinate(bodies=("b3",), reference="b1", direction=(0.1, 0.2, 0.7), relative=True)
SPEED = RelativeSpeed(body="b3", point=(0.1, 0.2, 0.3), reference="b1")


@dataclass(frozen=True)
class Given:
    """Values as they are."""

    series: np.ndarray

    def values(self, trajectory):
        return self.series


def on(values, step=0.1):
    return SimpleNamespace(times=step * np.arange(len(values))), Given(np.asarray(values, float))


def test_log_sum_exp_lies_below_the_maximum_by_the_time_near_it():
    run, quantity = on([0.0, 0.0, 2.0, 2.0, 0.0])
    found = LogSumExp(quantity=quantity, sharpness=50.0).value(run)
    assert found == pytest.approx(2.0 + np.log(2.0 / 4.0) / 50.0, abs=1e-12)
    low = LogSumExp(quantity=Given(-quantity.series), sharpness=-50.0).value(run)
    assert low == pytest.approx(-found, abs=1e-15)
    with pytest.raises(ValueError, match="log-sum-exp needs sharpness other than 0, got 0"):
        LogSumExp(quantity=quantity, sharpness=0.0).value(run)


def test_a_crossing_is_linear_between_nodes_and_only_upwards():
    run, quantity = on([3.0, 1.0, 0.0, 4.0, 0.0, 9.0])
    crossing = FirstCrossing(quantity=quantity, level=2.0, window=(0.1, 0.5))
    assert crossing.value(run) == pytest.approx(0.25)
    assert crossing.happens(run)
    # 3 is above at the start; from 0.1 s on 9.5 is never reached
    assert FirstCrossing(quantity=quantity, level=2.0).value(run) == 0.0
    never = FirstCrossing(quantity=quantity, level=9.5)
    assert (never.value(run), never.happens(run), never.weights(run)[0].weight) == (0.5, False, 0.0)


@pytest.mark.parametrize(
    "objective",
    [
        LogSumExp(quantity=HEIGHT, sharpness=300.0),
        PNorm(quantity=SPEED, p=12.0),
        FirstCrossing(quantity=SPEED, level=0.0),
        FirstCrossing(quantity=State(name="damage of bushing 'b2-b0'"), level=0.0),
    ],
    ids=["log-sum-exp", "speed", "time of a speed", "time of a damage"],
)
def test_slopes_through_a_run_are_those_of_differences(objective):
    rng = np.random.default_rng(11)
    system, density = random_tree(rng, count=5, first=0), rng.uniform(0.5, 1.0, 12)
    aim, run = rng.normal(size=12), tree_run(system, density, TIMES, SCHEME)
    if isinstance(objective, FirstCrossing):
        quantity = objective.quantity
        if isinstance(quantity, State):
            quantity = State(name=run.state_names[0])
        objective = FirstCrossing(quantity=quantity, level=level_inside(quantity.values(run)))
        assert objective.happens(run)

    def value(e):
        return objective.value(tree_run(system, density + e * aim, TIMES, SCHEME, keep=False))

    h = 1e-4
    expected = (8.0 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12.0 * h)
    assert discrete_adjoint(run, objective) @ aim == pytest.approx(expected, rel=1e-6)
    assert expected != 0.0


def level_inside(values):
    """A level that the series rises through within the step behind its steepest rise."""
    node = int(np.diff(values).argmax())
    assert values[node] == values[: node + 1].max()
    return 0.5 * (values[node] + values[node + 1])


def test_speed_and_rates_are_those_of_the_path_seen_from_the_body():
    rng = np.random.default_rng(5)
    run = tree_run(random_tree(rng, count=5, first=0), np.full(12, 0.5), np.linspace(0.0, 0.02, 401))
    frames = run.frames("b1")
    seen = np.einsum("tji,tj->ti", frames.axes, run.of("b3", SPEED.point) - frames.origin)
    path = np.linalg.norm(seen[2:] - seen[:-2], axis=1) / (2.0 * run.step)
    assert SPEED.values(run)[1:-1] == pytest.approx(path, rel=1e-3)
    view = HEIGHT.view(run)
    nodes = np.array([0, 7, 300])
    assert view.rates(nodes) == pytest.approx(np.array([view.seen(int(n)).rate for n in nodes]), rel=1e-12)


def test_what_cannot_be_measured_is_refused():
    run = SimpleNamespace(state_names=("slip",), states=np.zeros((3, 1)), state_rates=np.ones((3, 1)))
    with pytest.raises(ValueError, match="system has no state 'skid'; it has slip"):
        State(name="skid").values(run)
    assert State(name="slip").rates(run, np.array([1])) == 1.0
    with pytest.raises(ValueError, match="state 'slip' has no slopes of its rate"):
        State(name="slip").rate_slopes(run, 0)
    with pytest.raises(NotSupported, match="RelativeSpeed looks at bodies of a TreeSystem"):
        SPEED.values(SimpleNamespace())
    for slope in (lambda: SPEED.rates(run, np.arange(1)), lambda: SPEED.rate_slopes(run, 0)):
        with pytest.raises(NotSupported, match="RelativeSpeed has no rates"):
            slope()

"""Runs of trees that go on from where another ended: the whole to the bit, gradients with the start held."""

import numpy as np
import pytest

from tests.laws.engine.tree.test_gradients import mixed
from tests.sample_loops import four_bar
from tests.sample_trees import random_tree, tree_run
from workbench.engine import GeneralisedAlpha, RungeKutta8, gradient, parameter_gradient, simulate
from workbench.engine.tree import runs
from workbench.engine.tree.compiled import tree_compiled

TIMES = np.linspace(0.0, 0.03, 31)
QUOTIENT = 1e-7  # of differences of fourth order


def same(whole, rest, first):
    for name in ("position", "velocity", "acceleration", "states", "state_rates", "multiplier"):
        np.testing.assert_array_equal(getattr(rest, name), getattr(whole, name)[first:], err_msg=name)


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), RungeKutta8()], ids=repr)
@pytest.mark.parametrize("memory", [1e8, 0.0])
def test_two_parts_are_the_whole_to_the_bit(scheme, memory, monkeypatch):
    monkeypatch.setattr(runs, "MEMORY", memory)
    rng = np.random.default_rng(5)
    system = random_tree(rng, count=4)
    density = rng.uniform(0.3, 1.0, len(system.members))
    whole = simulate(system, density, times=TIMES, scheme=scheme)
    for seam in (1, 2, 15):
        left = simulate(system, density, times=TIMES[: seam + 1], scheme=scheme).state()
        rest = simulate(system, density, times=TIMES[seam:], scheme=scheme, start=left)
        same(whole, rest, seam)
        assert rest.step == whole.step
    middle = simulate(system, density, times=TIMES[9:20], scheme=scheme, start=whole.state(9))
    same(whole, simulate(system, density, times=TIMES[19:], scheme=scheme, start=middle.state()), 19)
    same(whole, simulate(system, density, times=TIMES[20:], scheme=scheme, start=rest.state(5)), 20)


def test_a_loop_goes_on_as_the_whole():
    system = four_bar()
    density, times = np.full(len(system.members), 0.5), np.linspace(0.0, 0.1, 21)
    whole = tree_run(system, density, times)
    same(whole, tree_run(system, density, times[8:], start=whole.state(8)), 8)


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(tolerance=1e-15), RungeKutta8()], ids=["alpha", "rk8"])
@pytest.mark.parametrize("memory", [1e8, 0.0])
def test_gradients_of_a_run_that_goes_on_hold_its_start(scheme, memory, monkeypatch):
    monkeypatch.setattr(runs, "MEMORY", memory)
    rng = np.random.default_rng(7)
    system = random_tree(rng, count=4)
    density = rng.uniform(0.3, 1.0, len(system.members))
    objective = mixed(rng, tree_compiled(system))
    left = simulate(system, density, times=TIMES[:11], scheme=scheme).state()

    def run(alpha):
        return simulate(system, alpha, times=TIMES[10:], scheme=scheme, start=left)

    rest = run(density)
    found = gradient(system, density, rest, objective)
    np.testing.assert_allclose(parameter_gradient(rest, objective).density, found, rtol=1e-12)
    along = rng.normal(size=len(density))
    low, below, above, high = (objective.value(run(density + k * 1e-3 * along)) for k in (-2, -1, 1, 2))
    slope = (8 * (above - below) - (high - low)) / 12e-3
    assert abs(found @ along - slope) < QUOTIENT * np.abs(found).max() * np.abs(along).sum()


def test_slopes_by_the_start_are_those_by_the_state_that_was_left():
    """By place and velocity of the state, its accelerations held: order 8 has none to hold."""
    system = random_tree(np.random.default_rng(7), count=4)
    density, objective = (
        np.full(len(system.members), 0.5),
        mixed(np.random.default_rng(8), tree_compiled(system)),
    )
    left = simulate(system, density, times=TIMES[:11], scheme=RungeKutta8()).state()
    rest = simulate(system, density, times=TIMES[10:], scheme=RungeKutta8(), start=left)
    fresh = tree_run(
        system, density, TIMES[10:], RungeKutta8(),
        start=(left.position, np.append(left.velocity, left.states)),
    )  # fmt: skip
    one, two = parameter_gradient(rest, objective), parameter_gradient(fresh, objective)
    np.testing.assert_allclose(one.velocity, two.velocity, rtol=1e-12)
    np.testing.assert_allclose(one.position, two.position, rtol=1e-12)


def test_a_start_of_another_tree_is_refused():
    rng = np.random.default_rng(5)
    one, other = random_tree(rng, count=4), random_tree(rng, count=5)
    left = simulate(one, np.full(len(one.members), 0.5), times=TIMES[:3]).state()
    with pytest.raises(ValueError, match="it comes from a run of another system"):
        simulate(other, np.full(len(other.members), 0.5), times=TIMES[2:], start=left)

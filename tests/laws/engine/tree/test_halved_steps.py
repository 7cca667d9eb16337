"""Steps that do not converge are made in halves: the run is that over the grid it took, slopes and all."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.laws.engine.tree.test_gradients import Mixed, mixed
from tests.sample_loops import four_bar
from tests.sample_trees import random_tree
from workbench.engine import (
    GeneralisedAlpha,
    NotConverged,
    gradient,
    parameter_gradient,
    parameter_slopes,
    simulate,
)
from workbench.engine.objectives.reductions import NodeWeight
from workbench.engine.tree import runs
from workbench.engine.tree.compiled import tree_compiled

# so few Newton steps that most steps of the run do not settle
SCHEME = GeneralisedAlpha(tolerance=1e-11, iterations=2)
ENOUGH = GeneralisedAlpha(tolerance=1e-15)
TIMES = np.linspace(0.0, 0.03, 9)
SAME = 1e-9  # of the largest: what that tolerance leaves
QUOTIENT = 1e-7
MOVE = 1e-4  # of a density or a mass: the same steps are halved


@pytest.fixture
def tree():
    rng = np.random.default_rng(7)
    system = random_tree(rng, count=4)
    return system, rng.uniform(0.3, 1.0, len(system.members)), mixed(rng, tree_compiled(system)), rng


@pytest.mark.parametrize("memory", [1e8, 0.0])
def test_the_run_is_that_over_the_grid_it_took(tree, memory, monkeypatch):
    monkeypatch.setattr(runs, "MEMORY", memory)
    system, density, objective, _ = tree
    run = simulate(system, density, times=TIMES, scheme=SCHEME)
    taken = run.taken.tables.times
    assert len(TIMES) < len(taken)
    over = simulate(system, density, times=taken, scheme=ENOUGH)
    assert over.diagnosis.halved == ()
    for name in ("position", "velocity", "acceleration", "states"):
        whole = getattr(over, name)[run.taken.at]
        np.testing.assert_allclose(
            getattr(run, name), whole, rtol=0.0, atol=SAME * np.abs(whole).max(), err_msg=name
        )
    found = gradient(system, density, run, objective)
    expected = gradient(system, density, over, at_taken(objective, run))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=SAME * np.abs(expected).max())


@dataclass(frozen=True, kw_only=True)
class At(Mixed):
    """The same, weighted over given nodes."""

    nodes: tuple

    def weights(self, r):
        return tuple(NodeWeight(node, weight) for node, weight in zip(self.nodes, (2.0, 1.0), strict=True))


def at_taken(objective, run):
    """An objective of a run as one of the run over all steps that it took."""
    last = len(run.times) - 1
    nodes = tuple(int(run.taken.at[node]) for node in (last, last // 2))
    return At(a=objective.a, b=objective.b, c=objective.c, nodes=nodes)


@pytest.mark.slow
def test_gradients_and_slopes_are_those_of_differences(tree):
    """At moved densities and masses the same steps are halved: the run is a smooth function of them."""
    system, density, objective, rng = tree

    def at(alpha, heavier=1.0):
        first, *others = system.bodies
        moved = replace(system, bodies=(replace(first, mass=first.mass * heavier), *others))
        run = simulate(moved, alpha, times=TIMES, scheme=SCHEME)
        assert len(run.taken.at) == len(TIMES)
        assert run.diagnosis.halved == here.diagnosis.halved
        return objective.value(run)

    here = simulate(system, density, times=TIMES, scheme=SCHEME)
    assert here.diagnosis.halved
    along = rng.normal(size=len(density))
    low, below, above, high = (at(density + k * MOVE * along) for k in (-2, -1, 1, 2))
    found = gradient(system, density, here, objective)
    slope = (8 * (above - below) - (high - low)) / (12.0 * MOVE)
    assert abs(found @ along - slope) < QUOTIENT * np.abs(found).max() * np.abs(along).sum()
    np.testing.assert_allclose(parameter_gradient(here, objective).density, found, rtol=1e-10)

    def heavier(x):
        first, *others = system.bodies
        return replace(system, bodies=(replace(first, mass=first.mass * x), *others))

    low, below, above, high = (at(density, 1.0 + k * MOVE) for k in (-2, -1, 1, 2))
    by_mass = parameter_slopes(here, objective, {"mass": (1.0, heavier)})["mass"]
    assert by_mass == pytest.approx((8 * (above - below) - (high - low)) / (12.0 * MOVE), rel=1e-6)


def test_a_run_with_halved_steps_goes_on_as_the_whole(tree):
    system, density, _, _ = tree
    whole = simulate(system, density, times=TIMES, scheme=SCHEME)
    for seam in (1, 4):
        rest = simulate(system, density, times=TIMES[seam:], scheme=SCHEME, start=whole.state(seam))
        assert rest.diagnosis.halved == tuple(t for t in whole.diagnosis.halved if t > TIMES[seam])
        for name in ("position", "velocity", "acceleration"):
            part = getattr(whole, name)[seam:]
            np.testing.assert_allclose(
                getattr(rest, name), part, rtol=0.0, atol=SAME * np.abs(part).max(), err_msg=name
            )


@pytest.mark.slow
def test_a_loop_with_halved_steps_is_that_over_its_grid():
    system = four_bar()
    density, times = np.full(len(system.members), 0.5), np.linspace(0.0, 0.1, 6)
    run = simulate(system, density, times=times, scheme=GeneralisedAlpha(tolerance=1e-15, iterations=3))
    assert run.diagnosis.halved
    over = simulate(system, density, times=run.taken.tables.times, scheme=ENOUGH)
    for name in ("position", "velocity", "multiplier"):
        whole = getattr(over, name)[run.taken.at]
        np.testing.assert_allclose(
            getattr(run, name), whole, rtol=0.0, atol=1e-9 * np.abs(whole).max(), err_msg=name
        )


def test_what_was_halved_is_told(tree, caplog):
    system, density, _, _ = tree
    with caplog.at_level("INFO", logger="workbench.engine"):
        run = simulate(system, density, times=TIMES, scheme=SCHEME)
    assert set(run.diagnosis.halved) <= set(TIMES.tolist())
    (said,) = run.diagnosis.notices
    count = len(run.diagnosis.halved)
    assert said.startswith(
        f"{count} of 8 steps did not converge and were made in parts, the shortest of 0.00"
    )
    assert f"{run.diagnosis.halved[0]:.6g}" in said
    assert said in caplog.text


def test_a_step_is_halved_as_often_as_the_scheme_says(tree):
    system, density, _, _ = tree
    none = replace(SCHEME, halvings=0)
    with pytest.raises(
        NotConverged, match=r"stopped at t = .* s: 2 Newton steps did not settle the accelerat"
    ):
        simulate(system, density, times=TIMES, scheme=none)
    one = replace(SCHEME, iterations=1, halvings=2)
    with pytest.raises(
        NotConverged,
        match=r"1 Newton steps did not settle .* of a step of 0.00093. s, halved 2 times. Take more",
    ):
        simulate(system, density, times=TIMES, scheme=one)
    with pytest.raises(ValueError, match="generalised-alpha needs halvings >= 0, got halvings=-1"):
        GeneralisedAlpha(halvings=-1)

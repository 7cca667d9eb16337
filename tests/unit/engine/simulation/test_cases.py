"""Many cases in threads: the numbers of single runs, to the bit."""

import threading
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.sample_trees import one_set_of_kernels, random_tree
from workbench.engine import (
    Case,
    Deviation,
    Floating,
    NotConverged,
    SpatialBody,
    Terminal,
    TreeSystem,
    gradient,
    simulate,
    simulate_cases,
)

__all__ = ["one_set_of_kernels"]

COUNT, STEPS, T_END = 12, 20, 0.05


def trees():
    """Variations of a tree with every element: other gravity, other densities."""
    rng = np.random.default_rng(5)
    system = random_tree(rng, count=5)
    return [
        Case(system=replace(system, gravity=(0.0, 0.3 * i, -9.81)), density=rng.uniform(0.3, 1.0, 12))
        for i in range(COUNT)
    ]


def ends(system):
    names = [body.name for body in system.bodies]
    return Terminal(quantity=Deviation(bodies=names[-2:], reference=names[1], weights=(1.0, 1.0, 1.0)))


def kept(run):
    return run.position.copy(), run.velocity.copy(), gradient(run.system, run.density, run, ends(run.system))


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_cases_have_the_numbers_of_single_runs_to_the_bit(threads):
    cases = trees()
    found = simulate_cases(cases, kept, T_END, STEPS, threads=threads)
    assert len(found) == COUNT
    for case, result in zip(cases, found, strict=True):
        assert result.error is None
        for one, other in zip(
            result.found, kept(simulate(case.system, case.density, T_END, STEPS)), strict=True
        ):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("threads", [1, 2])
def test_cases_are_made_where_they_run(threads):
    made = []

    def case(number):
        made.append(threading.get_ident())
        return trees()[number]

    found = simulate_cases([partial(case, k) for k in range(COUNT)], kept, T_END, STEPS, threads=threads)
    for one, other in zip(found, simulate_cases(trees(), kept, T_END, STEPS), strict=True):
        for mine, its in zip(one.found, other.found, strict=True):
            np.testing.assert_array_equal(mine, its)
    here = threading.get_ident()
    assert all((thread == here) == (threads == 1) for thread in made[1:])  # the first tells the kind


def test_a_case_that_stops_keeps_its_reason_and_the_others_go_on():
    loose = TreeSystem(bodies=(SpatialBody(name="nothing", joint=Floating()),))
    good = trees()[0]
    found = simulate_cases(
        [good, Case(system=loose, density=[]), good],
        lambda run: float(run.times[-1]),
        T_END,
        STEPS,
        threads=2,
    )
    assert [result.found for result in found] == [T_END, None, T_END]
    assert isinstance(found[1].error, NotConverged)
    assert "a joint moves nothing that has mass" in str(found[1].error)


def test_no_cases_give_no_results():
    assert simulate_cases([], lambda run: 0.0) == ()

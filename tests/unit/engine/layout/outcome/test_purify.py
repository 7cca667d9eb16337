"""Purified layouts: fewer fractional members with the same sums."""

from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from studies.two_body import layout_problem
from workbench.engine.errors import NotConverged
from workbench.engine.layout.formulation.problem import InvalidLayout, MemberGeometry
from workbench.engine.layout.optimise import as_layout_problem
from workbench.engine.layout.outcome.purify import fractional_members, purify, rigid_body_sums


def test_purification_keeps_the_sums_and_the_budget():
    problem = as_layout_problem(layout_problem("short"))
    rng = np.random.default_rng(2)
    density = problem.into_budgets(rng.uniform(0.0, 0.2, problem.members))
    clean = purify(problem, density, tolerance=1.0)
    sums = rigid_body_sums(problem.geometry)
    assert len(sums) == 6
    assert clean.fractional_before > 1000
    assert clean.fractional <= 7
    assert clean.excess <= 1e-9
    assert sums @ clean.density == pytest.approx(sums @ density, rel=1e-6, abs=1e-6)
    assert fractional_members(problem, clean.density) == clean.fractional


def test_a_purified_layout_that_cannot_be_run_is_not_accepted():
    problem = as_layout_problem(layout_problem("short"))
    density = problem.into_budgets(np.random.default_rng(2).uniform(0.0, 0.2, problem.members))

    def evaluate(tried):
        if not np.array_equal(tried, density):
            raise NotConverged("Newton steps left too much", time=0.1)
        return problem.evaluate(tried)

    clean = purify(replace(problem, evaluate=evaluate), density)
    assert not clean.accepted
    assert clean.loss == 0.0
    assert np.array_equal(clean.density, density)


def test_spatial_members_have_twenty_one_sums():
    rng = np.random.default_rng(0)
    geometry = MemberGeometry(
        body_a=np.zeros(60, dtype=int), point_a=rng.normal(size=(60, 3)), body_b=np.ones(60, dtype=int),
        point_b=rng.normal(size=(60, 3)), kind=("belt",) * 60,
    )  # fmt: skip
    assert len(rigid_body_sums(geometry)) == 21


def test_purification_needs_a_geometry():
    with pytest.raises(InvalidLayout, match="give `sums`, or a problem with a geometry"):
        purify(trusses.cantilever(), np.full(5, 5.0))

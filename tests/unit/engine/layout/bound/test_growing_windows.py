"""Starts from windows that grow: what a part of the time is, what it costs, where a chain leads."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from studies.two_body import square_points
from workbench.engine import Body, Deviation, Load, Maximum, Spring, System, VelocityVerlet, dense_members
from workbench.engine.layout.bound.growing_windows import CHAINS, Chain, InTime, grown_start
from workbench.engine.layout.bound.min_max import race, some_steps
from workbench.engine.layout.bound.trust_region import TrustRegionRun
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.remembered import remembering
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.history import Recorder

ROUNDING = 1e-12


def springs(*, t_end: float = 1.2, window: tuple[float, float] | None = None) -> LayoutProblem:
    """Two bodies tied by 8 x 13 springs, of which a tenth may be there."""
    system = System(
        bodies=(Body(name="1", mass=80.0, inertia=8.0), Body(name="2", mass=2000.0, inertia=6000.0)),
        members=dense_members(
            "1", "2", square_points(8, 0.35, 0.5), square_points(13, 1.1, 0.25), law=Spring(k=2000.0)
        ),
        loads=(Load(body="2", force=(9000.0, 15000.0), torque=-90000.0),),
    )
    return transient_problem(
        [Scenario(
            system=system, t_end=t_end, steps=round(200 * t_end), scheme=VelocityVerlet(),
            objective=Maximum(quantity=Deviation(bodies=("1",), reference="2"), window=window, refine=False),
        )],
        start=np.full(104, 0.1), budgets=[(np.ones(104), 10.4)], lower=1e-4,
    )  # fmt: skip


def test_the_first_part_of_a_run_is_that_of_the_whole():
    problem = springs()
    whole = problem.evaluate(problem.start)
    assert isinstance(problem.evaluate, InTime)
    shorter = problem.evaluate.until(0.25)
    assert shorter is not None
    part = shorter(problem.start)
    assert part.values.shape == (1, 61)
    assert np.allclose(part.values, whole.values[:, :61], rtol=ROUNDING)
    rows = np.array([20, 60])
    assert np.allclose(part.gradients(rows), whole.gradients(rows), rtol=ROUNDING, atol=ROUNDING)


def test_a_window_is_cut_or_begins_later():
    late = springs(window=(0.6, 1.0)).evaluate
    assert isinstance(late, InTime)
    assert late.until(0.4) is None
    cut, whole = late.until(0.7), late.until(0.9)
    assert cut is not None
    assert cut.scenarios[0].objective.window == pytest.approx((0.6, 0.84))
    assert whole is not None
    assert whole.scenarios[0].objective.window == (0.6, 1.0)
    kept = remembering(late)
    assert isinstance(kept, InTime)
    assert kept.until(0.4) is None


def test_a_chain_counts_its_evaluations_by_their_share_of_the_window():
    problem, chain = springs(t_end=0.4), Chain(first=0.5, by=0.25, evaluations=2)
    recorder = Recorder(problem)
    made = []

    def stays(
        part: LayoutProblem, density: np.ndarray, *, evaluations: int, recorder: Recorder
    ) -> np.ndarray:
        for _ in range(evaluations):
            recorder.add(density, part.checked(density))
        made.append(part.checked(density).values.shape[1])
        return density

    density = grown_start(problem, recorder, chain, stays, max_evaluations=50)
    assert made == [41, 61]
    assert recorder.beside == pytest.approx(2 * 0.5 + 2 * 0.75)
    assert recorder.evaluations == chain.cost == 3
    assert np.allclose(density, problem.start)
    assert grown_start(problem, recorder, chain, stays, max_evaluations=3) is None
    late = springs(t_end=0.4, window=(0.35, 0.4))
    assert grown_start(late, Recorder(late), chain, stays, max_evaluations=50) is None


def test_a_search_in_the_valley_of_a_better_one_is_left():
    problem = springs(t_end=0.4)
    recorder = Recorder(problem)

    def search(density: np.ndarray, index: int) -> TrustRegionRun:
        return TrustRegionRun(
            problem=problem, recorder=recorder, density=density, evaluation=problem.checked(density),
            tolerance=1e-6, index=index,
        )  # fmt: skip

    best = search(problem.start, 0)
    while not best.finished:
        best.step()
    near = 0.999 * best.density + 0.001 * problem.start
    one, other = search(near, 1), search(problem.start, 2)
    made = recorder.evaluations
    race([best, one, other], recorder, max_evaluations=made + 5)
    assert one.steps == 0
    assert other.steps == 5


@pytest.mark.slow
def test_a_long_search_ends_where_its_chains_and_other_starts_end_best():
    problem = springs()
    steps = partial(some_steps, tolerance=1e-6)
    ends = []
    for chain in CHAINS[:2]:
        grown = grown_start(problem, Recorder(problem), chain, steps, max_evaluations=1000)
        assert grown is not None
        begun = replace(problem, start=grown)
        ends.append(optimise_layout(begun, max_evaluations=30, multi_start=False, compare=False).value)
    found = optimise_layout(problem, max_evaluations=200)
    assert found.value <= 1.001 * min(ends)
    assert found.evaluations <= 200
    assert found.value <= 1.001 * min(found.ends)
    assert len(found.ends) > 3
    assert any("no lower bound" in said for said in found.verdicts)

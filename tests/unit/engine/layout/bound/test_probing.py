"""Starts from runs without gradients: the search itself, the directions it searches in, what it is worth."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pytest
from scipy.optimize import minimize

from studies import trusses
from studies.two_body import square_points
from tests.limited_layouts import limited
from workbench.engine import Body, Deviation, Load, Maximum, Spring, System, VelocityVerlet, dense_members
from workbench.engine.errors import NotConverged
from workbench.engine.layout.bound import probing
from workbench.engine.layout.bound.min_max import race
from workbench.engine.layout.bound.probing import (
    evolve,
    probed_starts,
    probes_by_default,
    seen_directions,
    spread,
    within_budgets,
)
from workbench.engine.layout.bound.trust_region import TrustRegionRun
from workbench.engine.layout.formulation.problem import (
    InvalidLayout,
    LayoutProblem,
    TabulatedRows,
    static_problem,
)
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.history import Recorder


def springs(
    inner: int = 6, outer: int = 9, t_end: float = 1.2, sensitivities: Literal["auto", "adjoint"] = "auto"
) -> LayoutProblem:
    """Two bodies tied by inner x outer springs, of which a tenth is there, on a window of several periods."""
    bodies = (Body(name="1", mass=60.0, inertia=10.0), Body(name="2", mass=2000.0, inertia=6000.0))
    system = System(
        bodies=bodies,
        members=dense_members(
            "1", "2", square_points(inner, 0.3, 0.5), square_points(outer, 1.0, 0.25),
            law=Spring(k=900.0 * 1020 / (inner * outer)),
        ),
        loads=(Load(body="2", force=(19600.0, 0.0), torque=120000.0),),
    )  # fmt: skip
    n = inner * outer
    return transient_problem(
        [Scenario(
            system=system, objective=Maximum(quantity=Deviation(bodies=("1",), reference="2"), refine=False),
            t_end=t_end, steps=round(300 * t_end), scheme=VelocityVerlet(),
        )],
        start=np.full(n, 0.1), budgets=[(np.ones(n), 0.1 * n)], lower=1e-4,
        sensitivities=sensitivities,
    )  # fmt: skip


def nearest(problem: LayoutProblem, point: np.ndarray) -> np.ndarray:
    """The same projection by SLSQP."""
    found = minimize(
        lambda a: 0.5 * ((a - point) ** 2).sum(), spread(problem), jac=lambda a: a - point, method="SLSQP",
        bounds=list(zip(problem.lower, problem.upper, strict=True)), options={"ftol": 1e-14, "maxiter": 500},
        constraints=[
            {"type": "eq", "fun": lambda a, c=c, h=h: c @ a - h, "jac": lambda a, c=c: c}
            for c, h in zip(problem.costs, problem.limits, strict=True)
        ],
    )  # fmt: skip
    return np.asarray(found.x)


@pytest.mark.parametrize("seed", range(4))
def test_points_are_drawn_to_the_nearest_design_that_uses_the_budgets(seed: int):
    rng = np.random.default_rng(seed)
    n = 12
    first = rng.uniform(0.5, 2.0, n)
    first[: n // 2 if seed % 2 else 0] = 0.0  # one budget of all members, or two of half of them each
    budgets = [(first, 0.3 * first.sum())]
    if seed % 2:
        other = np.where(first > 0, 0.0, rng.uniform(0.5, 2.0, n))
        budgets.append((other, 0.4 * other.sum()))
    problem = static_problem(lambda a: (0.0, 0 * a), start=np.full(n, 0.1), budgets=budgets)
    point = rng.normal(0.3, 0.6, n)
    design = within_budgets(problem, point)
    assert np.allclose(design, nearest(problem, point), atol=1e-6)
    assert np.allclose(problem.usage(design), 1.0, atol=1e-9)


def test_common_members_leave_a_design_within_all_budgets():
    rng = np.random.default_rng(5)
    costs = rng.uniform(0.0, 1.0, (3, 20))
    problem = static_problem(
        lambda a: (0.0, 0 * a), start=np.zeros(20), budgets=[(c, 0.25 * c.sum()) for c in costs]
    )
    design = within_budgets(problem, rng.normal(0.5, 1.0, 20))
    assert problem.excess(design) <= 1e-12
    assert problem.usage(design).max() > 0.99
    assert ((design >= 0) & (design <= 1)).all()


def test_the_strategy_adapts_to_a_bent_valley_and_stays_out_of_failures():
    def valley(y: np.ndarray) -> float:
        if y[0] > 1.4:
            return np.inf  # a model that fails
        return float((1 - y[0]) ** 2 + 100 * (y[1] - y[0] ** 2) ** 2 + 1.0)

    end = evolve(valley, np.array([-1.0, 1.0]), width=0.3, most=3000, rng=np.random.default_rng(1))
    assert end.value < 1.0 + 1e-2
    assert end.used <= 3000


def test_a_search_takes_no_more_values_than_it_may():
    taken = []

    def count(y: np.ndarray) -> float:
        taken.append(y)
        return float(y @ y + np.sin(40 * y).sum())

    end = evolve(count, np.ones(5), width=1.0, most=100, rng=np.random.default_rng(0))
    assert len(taken) == end.used == 96  # six generations of 16


def test_several_designs_show_directions_that_the_even_layout_hides():
    problem = springs()
    recorder = Recorder(problem)
    V = seen_directions(problem, recorder, max_evaluations=50, rng=np.random.default_rng(0))
    alone = seen_directions(problem, Recorder(problem), max_evaluations=1, rng=np.random.default_rng(0))
    assert recorder.evaluations == 8
    assert len(alone) < len(V) <= 8
    assert np.allclose(V @ V.T, np.eye(len(V)), atol=1e-9)
    assert np.abs(V @ problem.costs.T).max() < 1e-9


def test_a_model_that_fails_at_some_designs_is_searched_all_the_same():
    whole = springs(4, 6, 0.6)

    def evaluate(density):
        if density[0] > 0.4:
            raise NotConverged("too stiff")
        return whole.evaluate(density)

    problem = replace(whole, evaluate=evaluate)
    recorder = Recorder(problem)
    starts = probed_starts(
        problem, recorder, probes=100, max_evaluations=20, most=5, rng=np.random.default_rng(0)
    )
    assert starts
    assert all(design[0] <= 0.4 for _, design in starts)
    assert recorder.probes <= 100
    assert starts[0][0] == min(value for value, _ in starts)


def test_budgets_that_do_not_bind_leave_nothing_to_search():
    roomy = replace(springs(4, 6, 0.2), limits=np.array([25.0]))  # of 24 members
    recorder = Recorder(roomy)
    rng = np.random.default_rng(0)
    assert probed_starts(roomy, recorder, probes=100, max_evaluations=20, most=5, rng=rng) == []
    assert recorder.probes == recorder.evaluations == 0


@pytest.mark.parametrize(("probes", "most", "starts"), [(200, 2, 2), (70, 5, 1)])
def test_searches_are_as_many_as_their_steps_can_be_paid_for(probes: int, most: int, starts: int):
    problem = springs(4, 6, 0.5)
    found = probed_starts(
        problem, Recorder(problem), probes=probes, max_evaluations=20, most=most, rng=np.random.default_rng(0)
    )
    assert len(found) <= starts
    assert [value for value, _ in found] == sorted(value for value, _ in found)
    designs = [design for _, design in found]
    assert all(problem.excess(design) <= 1e-9 for design in designs)


@dataclass
class Falling:
    """A search whose value falls by a step each time until it is at the bottom."""

    index: int
    value: float
    fall: float
    bottom: float
    taken: Recorder
    steps: int = 0

    @property
    def evaluation(self) -> TabulatedRows:
        return TabulatedRows(
            values=np.array([[self.value, float(self.index)]]), gradient_table=np.zeros((2, 1))
        )

    @property
    def finished(self) -> bool:
        return self.value <= self.bottom

    def step(self) -> None:
        self.value = max(self.bottom, self.value - self.fall)
        self.steps += 1
        self.taken.history.append(None)


def test_the_search_that_may_be_the_best_is_pursued_and_every_one_has_its_turn():
    recorder = Recorder(springs(4, 6, 0.2))
    low = Falling(0, 0.50, 0.005, 0.45, recorder)
    far = Falling(1, 2.00, 0.10, 0.30, recorder)
    slow = Falling(2, 1.50, 0.01, 0.20, recorder)
    race([low, far, slow], recorder, max_evaluations=40)
    assert (low.steps, far.steps, slow.steps) == (10, 17, 13)  # slow: a block, and what is left at the end
    race([low, far, slow], recorder, max_evaluations=400)
    assert low.finished
    assert far.finished
    assert slow.finished


def test_corrected_steps_go_further_with_the_same_gradients():
    problem = springs()
    values = []
    for most in (0, 1000):
        recorder = Recorder(problem)
        evaluation = problem.checked(problem.start)
        recorder.add(problem.start, evaluation)
        run = TrustRegionRun(
            problem=problem, recorder=recorder, density=problem.start, evaluation=evaluation, tolerance=1e-6,
            most_probes=most,
        )  # fmt: skip
        while recorder.evaluations < 8 and not run.finished:
            run.step()
        values.append(recorder.best)
        assert (recorder.probes > 0) == (most > 0)
    assert values[1] < values[0]


def test_where_no_search_can_be_paid_for_none_is_prepared():
    problem = springs(4, 6, 0.5)
    recorder = Recorder(problem)
    rng = np.random.default_rng(0)
    assert probed_starts(problem, recorder, probes=100, max_evaluations=20, most=0, rng=rng) == []
    assert recorder.evaluations == recorder.probes == 0


def test_probes_are_counted_beside_the_evaluations_and_said():
    problem = springs(4, 6, 0.5)
    result = optimise_layout(problem, max_evaluations=16, probes=200)
    again = optimise_layout(problem, max_evaluations=16, probes=200)
    plain = optimise_layout(problem, max_evaluations=16, probes=0)
    assert 0 < result.probes <= 200
    assert result.evaluations <= 16
    assert np.array_equal(result.density, again.density)
    assert plain.probes == 0
    assert any("runs without gradients" in said for said in result.verdicts)
    assert not any("runs without gradients" in said for said in plain.verdicts)


def test_long_searches_of_moving_systems_make_them_unless_told(monkeypatch):
    monkeypatch.setattr(probing, "_ENOUGH", 16)
    problem = springs(4, 6, 0.5)
    chosen = optimise_layout(problem, max_evaluations=16)
    told = optimise_layout(problem, max_evaluations=16, probes=320)
    assert chosen.probes == told.probes > 0
    assert np.array_equal(chosen.density, told.density)
    assert optimise_layout(problem, max_evaluations=16, probes=0).probes == 0
    assert optimise_layout(problem, max_evaluations=15).probes == 0
    assert optimise_layout(problem, max_evaluations=16, multi_start=False).probes == 0
    assert optimise_layout(problem, "oc", max_evaluations=16).probes == 0


@pytest.mark.parametrize(("evaluations", "count"), [(199, 0), (200, 4000), (300, 6000)])
def test_they_are_twenty_per_evaluation_from_two_hundred_on(evaluations: int, count: int):
    problem = springs(4, 6, 0.2)
    assert probes_by_default(problem.evaluate(problem.start), evaluations) == count


def test_static_and_limited_layouts_and_those_with_backward_sweeps_make_none():
    truss = trusses.problem(trusses.ground_structure(columns=3, rows=3))
    assert probes_by_default(truss.evaluate(truss.start), 500) == 0
    problem, _, _ = limited(2, "response")
    assert probes_by_default(problem.evaluate(problem.start), 500) == 0
    swept = springs(4, 6, 0.2, sensitivities="adjoint")
    assert probes_by_default(swept.evaluate(swept.start), 500) == 0


def test_a_count_that_cannot_be_used_is_refused():
    with pytest.raises(InvalidLayout, match=r"probes needs to be >= 0, and .* got -1, 'gsao'"):
        optimise_layout(springs(4, 6, 0.2), probes=-1)
    with pytest.raises(InvalidLayout, match="0 unless 'gsao' chooses, got 10, 'mma'"):
        optimise_layout(springs(4, 6, 0.2), "mma", probes=10)


@pytest.mark.slow
def test_a_window_of_several_periods_from_starts_that_differ():
    problem = springs(13, 20, 1.6)
    even = float(problem.evaluate(problem.start).values.max())
    other = problem.into_budgets(np.random.default_rng(11).uniform(0.0, 1.0, problem.members) ** 4)
    result = optimise_layout(replace(problem, start=other), max_evaluations=100, probes=2000)
    assert result.probes > 0
    assert result.value < 0.67 * even  # 0.638

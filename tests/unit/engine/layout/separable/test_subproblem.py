"""Separable models, their dual and presets."""

import numpy as np
import pytest

from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.separable import sequence
from workbench.engine.layout.separable.dual import kkt_residual, solve_subproblem
from workbench.engine.layout.separable.model import SeparableModel
from workbench.engine.layout.separable.presets import (
    ConvexLinearisation,
    DiagonalQuadratic,
    LinearProgramme,
    MovingAsymptotes,
    OptimalityCriteria,
    Point,
    TwoPoint,
)

EXACT = 1e-13  # value and gradient at the point, relative: a few roundings
ITERATE = 1e-10  # presets against independent implementations
SUBPROBLEMS = 100


def slow_model(model, x):
    """The numpy twin of the kernel: (7.5) to (7.7) term by term, as printed but at alpha^k."""
    values = model.values.copy()
    gradients = np.zeros_like(model.gradients)
    for j in range(len(values)):
        for i in range(len(x)):
            g, p, q = model.gradients[j, i], model.exponents[j, i], model.curvatures[j, i]
            d = x[i] - model.point[i]
            if p == 1:
                values[j] += g * d
                gradients[j, i] = g
            else:
                s = model.distances[j, i]
                c = model.point[i] - s
                a = np.sign(s) * abs(s) ** (1 - p) * g
                values[j] += (
                    g * s * np.log((x[i] - c) / s) if p == 0 else a / p * (abs(x[i] - c) ** p - abs(s) ** p)
                )
                gradients[j, i] = g * ((x[i] - c) / s) ** (p - 1)
            values[j] += 0.5 * q * d * d
            gradients[j, i] += q * d
    return values, gradients


def random_model(rng, n=12, m=2):
    x = rng.uniform(0.1, 0.9, n)
    signs = rng.normal(size=(m + 1, n))
    s = np.where(rng.random((m + 1, n)) < 0.5, x, x - 1.2)
    return SeparableModel.build(
        x, rng.normal(size=m + 1), signs, lower=np.maximum(0.02, x - 0.3), upper=np.minimum(1, x + 0.3),
        distances=s, exponents=rng.choice([-3, -1, 0, 0.5, 1, 2, 3], size=(m + 1, n)),
        curvatures=rng.random((m + 1, n)) * (rng.random((m + 1, n)) < 0.3),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(20))
def test_budgets_that_share_no_member_are_solved_one_by_one(seed):
    rng = np.random.default_rng(seed)
    n, m = 40, 3
    x = rng.uniform(0.1, 0.9, n)
    owner = rng.integers(-1, m, n)  # -1: in no budget
    gradients = np.vstack(
        [rng.normal(size=n), rng.uniform(0.2, 2.0, (m, n)) * (owner == np.arange(m)[:, None])]
    )
    values = np.r_[1.0, -rng.uniform(0.0, 0.5, m)]
    model = SeparableModel.build(
        x, values, gradients, lower=np.full(n, 0.02), upper=np.ones(n), distances=x,
        exponents=np.vstack([np.full(n, -1.0), np.ones((m, n))]),
    )  # fmt: skip
    apart = solve_subproblem(model)
    assert kkt_residual(model, apart) <= 1e-9
    # a fourth constraint that sees everything and never binds sends it to the general solver
    loose = SeparableModel.build(
        x, np.r_[values, -1e4], np.vstack([gradients, np.ones(n)]), lower=np.full(n, 0.02), upper=np.ones(n),
        distances=x, exponents=np.vstack([np.full(n, -1.0), np.ones((m + 1, n))]),
    )  # fmt: skip
    general = solve_subproblem(loose)
    assert apart.x == pytest.approx(general.x, abs=1e-6)
    assert apart.multipliers == pytest.approx(general.multipliers[:m], rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("seed", range(10))
def test_the_kernel_agrees_with_its_twin(seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng)
    x = rng.uniform(model.lower, model.upper)
    for found, expected in zip(model.at(x), slow_model(model, x), strict=True):
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-12)


def test_printed_constants_would_make_the_model_constant():
    # (7.6) and (7.7) are printed at alpha_i: so read, the model is G(alpha^k) everywhere
    alpha_k, g, xi, c = 0.4, -2.0, -1.0, 0.0
    for alpha in (0.2, 0.4, 0.8):
        a = np.sign(alpha - c) * abs(alpha - c) ** (1 - xi) * g / xi
        assert (5.0 - a * abs(alpha - c) ** xi) + a * abs(alpha - c) ** xi == 5.0
    model = SeparableModel.build(
        np.array([alpha_k]), np.array([5.0]), np.array([[g]]), lower=np.array([0.1]), upper=np.array([1.0]),
        distances=alpha_k - c, exponents=xi,
    )  # fmt: skip
    assert model.at(np.array([0.8]))[0][0] == pytest.approx(5.0 + g * alpha_k**2 * (1 / alpha_k - 1 / 0.8))


def test_an_idle_budget_has_price_zero():
    # (7.9) prints lambda_j > 0
    model = SeparableModel.build(
        np.array([0.5]), np.array([1.0, -9.0]), np.array([[2.0], [1.0]]), lower=np.zeros(1), upper=np.ones(1)
    )
    solution = solve_subproblem(model)
    assert solution.multipliers == [0.0]
    assert solution.x == [0.0]


def test_an_infeasible_subproblem_is_elastic_and_says_so():
    one = np.ones(2)
    model = SeparableModel.build(
        0.5 * one, np.array([0.0, 1.0]), np.vstack([-one, one]), lower=0.4 * one, upper=0.6 * one,
        distances=0.5, exponents=np.array([[-1.0], [1.0]]),
    )  # fmt: skip
    solution = solve_subproblem(model)
    assert solution.elastic
    assert solution.x == pytest.approx(0.4 * one)


# independent implementations: bisection on the price with the textbook update of each method


def by_bisection(update, constraint, low=0.0, high=1e12):
    if constraint(update(0.0)) <= 0:
        return update(0.0)
    for _ in range(400):
        if high < 1e-25:  # only members that the objective does not see react to so small a price
            break
        middle = np.sqrt(low * high) if low > 0 else high * 1e-3
        if constraint(update(middle)) > 0:
            low = middle
        else:
            high = middle
        if low > 0 and high / low < 1 + 1e-15:
            break
    return update(high)


def layout_subproblem(rng, n=30):
    x = rng.uniform(0.1, 0.6, n)
    f = rng.normal(size=n) * 10 ** rng.uniform(-2, 2)
    f[rng.random(n) < 0.1] = 0.0
    v = rng.uniform(0.2, 2, n) * (rng.random(n) < 0.9)
    return x, f, v, -rng.uniform(-0.02, 0.05) * v.sum()


@pytest.mark.parametrize("seed", range(SUBPROBLEMS))
@pytest.mark.parametrize("name", ["oc", "conlin", "mma", "slp", "dsqp"])
def test_presets_reproduce_independent_updates(name, seed):
    rng = np.random.default_rng(seed)
    x, f, v, h = layout_subproblem(rng)
    n = len(x)
    lower, upper = np.full(n, 1e-3), np.ones(n)
    point = Point(x=x, values=np.array([1.0, h]), gradients=np.vstack([f, v]))

    def room(y):
        return h + v @ (y - x)

    if name == "oc":  # Bendsoe: x sqrt(-f/(l v)); lower end where the objective does not fall
        preset = OptimalityCriteria(move=0.2)
        lo, hi = np.maximum(lower, x - 0.2 * (upper - lower)), np.minimum(upper, x + 0.2 * (upper - lower))

        def update(price):
            with np.errstate(divide="ignore", invalid="ignore"):
                new = np.where(price * v > 0, x * np.sqrt(np.maximum(-f, 0) / (price * v)), np.inf)
            new = np.where((f == 0) & (v * price == 0), x, new)
            new = np.where((f >= 0) & ((f > 0) | (v * price > 0)), lo, new)
            return np.clip(new, lo, hi)
    elif name == "conlin":  # reciprocal where f < 0: minimise -f x^2/y + l v y; linear where f > 0
        preset = ConvexLinearisation()
        lo, hi = lower, upper

        def update(price):
            with np.errstate(divide="ignore", invalid="ignore"):
                new = np.where(price * v > 0, np.sqrt(np.maximum(-f, 0) * x**2 / (price * v)), np.inf)
            new = np.where((f == 0) & (v * price == 0), x, new)
            new = np.where((f >= 0) & ((f > 0) | (v * price > 0)), lo, new)
            return np.clip(new, lo, hi)
    elif name == "mma":  # Svanberg 1987: asymptotes half a width away, 0.1 of it kept free
        preset = MovingAsymptotes()
        reach = 0.5 * (upper - lower)
        L, U = x - reach, x + reach
        lo, hi = np.maximum(lower, x - 0.9 * reach), np.minimum(upper, x + 0.9 * reach)
        p0, q0 = np.maximum(f, 0) * reach**2, np.maximum(-f, 0) * reach**2
        p1 = v * reach**2

        def update(price):
            # minimise (p0 + l p1)/(U - y) + q0/(y - L): sqrt(P) (y - L) = sqrt(Q) (U - y)
            a, b = np.sqrt(p0 + price * p1), np.sqrt(q0)
            with np.errstate(invalid="ignore"):
                new = (a * L + b * U) / (a + b)
            return np.clip(np.where(a + b == 0, x, new), lo, hi)

        def room(y):
            return h + (p1 * (1 / (U - y) - 1 / (U - x))).sum()
    elif name == "slp":
        from scipy.optimize import linprog

        preset = LinearProgramme(move=0.1)
        lo, hi = np.maximum(lower, x - 0.1 * (upper - lower)), np.minimum(upper, x + 0.1 * (upper - lower))
        solved = linprog(f, A_ub=[v], b_ub=[v @ x - h], bounds=np.column_stack([lo, hi]), method="highs-ipm")
        mine = solve_subproblem(preset.model([point], lower, upper))
        if solved.x is None:
            assert mine.elastic
        else:
            assert f @ mine.x == pytest.approx(f @ solved.x, rel=ITERATE, abs=ITERATE * np.abs(f).max())
            assert room(mine.x) <= 1e-9
        return
    else:  # diagonal quadratic: y = x - (f + l v)/(H0 + l H1), H = 2 |g|/width
        preset = DiagonalQuadratic()
        width = upper - lower
        H0, H1 = 2 * np.abs(f) / width, 2 * v / width
        lo, hi = np.maximum(lower, x - 0.5 * width), np.minimum(upper, x + 0.5 * width)

        def update(price):
            with np.errstate(divide="ignore", invalid="ignore"):
                new = x - (f + price * v) / (H0 + price * H1)
            return np.clip(np.where(H0 + price * H1 == 0, x, new), lo, hi)

        def room(y):
            return h + v @ (y - x) + 0.5 * H1 @ (y - x) ** 2

    mine = solve_subproblem(preset.model([point], lower, upper))
    if mine.elastic:
        assert room(update(1e12)) > 0
    else:
        seen = f != 0  # where the objective is blind several designs are optimal
        assert mine.x[seen] == pytest.approx(by_bisection(update, room)[seen], abs=ITERATE)
        assert room(mine.x) <= 1e-9


def test_the_exponent_form_of_dsqp_is_the_added_curvature():
    rng = np.random.default_rng(0)
    x, f, _, _ = layout_subproblem(rng)
    f[f == 0] = 1.0
    H = rng.uniform(0.5, 2, len(x))
    centred = SeparableModel.build(
        x, np.array([1.0]), f[None], lower=x - 0.4 * np.abs(f) / H, upper=x + 0.4 * np.abs(f) / H,
        distances=f / H, exponents=2.0,
    )  # fmt: skip
    added = SeparableModel.build(
        x, np.array([1.0]), f[None], lower=centred.lower, upper=centred.upper, curvatures=H
    )
    y = rng.uniform(centred.lower, centred.upper)
    assert centred.at(y)[0] == pytest.approx(added.at(y)[0], rel=1e-12)


def test_two_points_recover_the_exponent_of_a_power():
    x0, x1 = np.array([0.5]), np.array([0.6])
    points = [
        Point(x=x, values=np.array([x[0] ** -3.0]), gradients=np.array([[-3 * x[0] ** -4.0]]))
        for x in (x0, x1)
    ]
    model = TwoPoint().model(points, np.array([0.1]), np.array([1.0]))
    assert model.exponents == pytest.approx(np.array([[-3.0]]), rel=1e-10)
    assert model.at(np.array([0.9]))[0][0] == pytest.approx(0.9**-3.0, rel=1e-10)


def test_a_member_at_zero_can_grow_again():
    # (7.11) with c = 0 multiplies by alpha: nothing leaves 0; the centre keeps clear of the point
    point = Point(x=np.zeros(1), values=np.array([1.0, -0.5]), gradients=np.array([[-1.0], [1.0]]))
    model = OptimalityCriteria().model([point], np.zeros(1), np.ones(1))
    assert solve_subproblem(model).x[0] > 0


def test_value_gradient_and_kkt_of_a_general_model():
    for seed in range(20):
        model = random_model(np.random.default_rng(seed), n=25, m=3)
        values, gradients = model.at(model.point)
        assert np.abs(values - model.values).max() <= EXACT * np.abs(model.values).max()
        assert np.abs(gradients - model.gradients).max() <= EXACT * np.abs(model.gradients).max()
        assert (model.second_derivatives(model.point) >= 0).all()
        solution = solve_subproblem(model)
        if not solution.elastic:
            assert kkt_residual(model, solution) <= 1e-9


def bound_model(rng, n, kind):
    """Three falling rows under a bound and a budget, as a preset linearises them: min t, f_j - t <= 0."""
    width, rows = 1.0, 3
    x = rng.uniform(0.03, 0.15, n)
    w, cost = rng.uniform(0.1, 10, (rows, n)), rng.uniform(0.5, 2, n)
    values = (w / (x + 0.05)).sum(axis=1)
    t = float(values.max())
    gradients = np.zeros((rows + 2, n + 1))
    gradients[0, -1], gradients[1:-1, -1], gradients[-1, :n] = 1.0, -1.0, cost
    gradients[1:-1, :n] = -w / (x + 0.05) ** 2
    room = 0.2 * np.abs(gradients[1:-1, :n]).sum(axis=1).max()
    lower, upper = np.r_[np.full(n, 1e-4), t - 10 * room], np.r_[np.full(n, width), t + room]
    table = np.r_[t, values - t, cost @ x - 0.11 * cost.sum()]
    reach, falls = 0.5 * (upper - lower), gradients < 0
    choice = {
        "mma": (np.where(falls, reach, -reach), np.full(gradients.shape, -1.0), 0.0),
        "two points": (np.r_[x, t], np.where(falls, rng.uniform(-3, 1, gradients.shape), 1.0), 0.0),
        "dsqp": (np.inf, np.ones(gradients.shape), 2 * np.abs(gradients) / (upper - lower)),
    }
    distances, exponents, curvatures = choice[kind]
    exponents[:, -1] = 1.0
    curvatures = np.broadcast_to(curvatures, gradients.shape).copy()
    curvatures[:, -1] = 0.0
    return SeparableModel.build(
        np.r_[x, t], table, gradients, lower=lower, upper=upper, distances=distances, exponents=exponents,
        curvatures=curvatures,
    )  # fmt: skip


@pytest.mark.parametrize("n", [40, 3000])
@pytest.mark.parametrize("kind", ["mma", "two points", "dsqp"])
def test_rows_under_a_bound_are_solved_to_the_last_digits(kind, n):
    model = bound_model(np.random.default_rng(n), n, kind)
    assert kkt_residual(model, solve_subproblem(model)) <= 1e-10


@pytest.mark.parametrize("method", ["mma", "gcmma", "conlin", "dsqp", "gsao_two_point"])
def test_the_bound_stays_linear_in_a_box_that_its_rows_need(method, monkeypatch):
    seen = []

    def solve(model):
        seen.append(model)
        return solve_subproblem(model)

    monkeypatch.setattr(sequence, "solve_subproblem", solve)
    w = np.random.default_rng(3).uniform(0.1, 10, (3, 30))
    problem = static_problem(
        lambda a: ((w / (a + 0.05)).sum(axis=1), -w / (a + 0.05) ** 2), start=np.full(30, 0.1), lower=1e-4,
        budgets=[(np.ones(30), 3.0)],
    )  # fmt: skip
    result = optimise_layout(problem, method, max_evaluations=12)
    for model in seen:
        assert (model.exponents[:, -1] == 1).all()
        assert (model.curvatures[:, -1] == 0).all()
        rows = model.gradients[:, -1] < 0
        found = solve_subproblem(model)
        assert model.lower[-1] < found.x[-1] <= model.point[-1] + 1e-9 * abs(model.point[-1])
        reach = np.abs(model.gradients[rows, :-1]) @ (model.upper - model.lower)[:-1]
        assert model.upper[-1] - model.lower[-1] <= 1.5 * reach.max() + np.ptp(model.values[rows])
    assert result.value < 0.99 * result.start_value


def test_a_box_is_drawn_in_to_what_steep_curvatures_allow():
    # next to a mechanism secants are 1e16 times what a step can use: members of such a row hardly move
    rng = np.random.default_rng(4)
    n = 20
    x, slopes = rng.uniform(0.1, 0.2, n), -rng.uniform(1, 2, n)
    steep = np.where(np.arange(n) < 8, 1e16, 1.0)
    model = SeparableModel.build(
        x, np.array([0.0, -1.0, 0.0]), np.vstack([slopes, 0.1 * slopes, np.ones(n)]), lower=np.full(n, 1e-6),
        upper=np.ones(n), curvatures=np.vstack([np.ones(n), steep, np.zeros(n)]),
    )  # fmt: skip
    part = model.within_reach()
    assert (part.upper - part.lower)[:8].max() < 1e-6
    assert (part.lower[8:] == model.lower[8:]).all()
    assert (part.upper[8:] == model.upper[8:]).all()
    terms = np.zeros(n)
    for side in (part.lower, part.upper):  # each is still where its term is above all that others take back
        d = side - x
        terms = np.maximum(terms, 0.1 * slopes * d + 0.5 * steep * d * d)
    others = 0.1 * np.abs(slopes) @ (model.upper - model.lower)
    assert (terms[:8] > others + 1.0).all()
    solution = solve_subproblem(model)
    assert kkt_residual(part, solution) <= 1e-10
    assert model.at(solution.x)[0][1:].max() <= 1e-12


def test_what_cannot_be_met_is_missed_at_the_least_price():
    # two budgets at odds with each other: the cap is the same for both in units of their reach
    n = 12
    one, w = np.ones(n), np.random.default_rng(6).uniform(0.5, 2, n)
    model = SeparableModel.build(
        0.5 * one, np.array([0.0, 3.0, 2.0]), np.vstack([-w, one, -one]), lower=0.2 * one, upper=0.8 * one,
        distances=0.5, exponents=np.vstack([-one, one, one]),
    )  # fmt: skip
    solution = solve_subproblem(model)
    assert solution.elastic
    over, under = 3.0 + (solution.x - 0.5).sum(), 2.0 - (solution.x - 0.5).sum()
    assert over + under == pytest.approx(5.0)  # one misses what the other gains
    assert min(over, under) >= -1e-9
    reach = np.abs(model.gradients) @ (model.upper - model.lower)
    caps = 1e6 * reach[0] / reach[1:]
    assert kkt_residual(model, solution, caps) <= 1e-9

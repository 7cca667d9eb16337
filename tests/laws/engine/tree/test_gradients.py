"""The discrete adjoint of trees against complex step through a plain twin of the scheme, and differences."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.laws.engine.tree.test_equations import TINY, Complex, times_exponential
from tests.sample_trees import random_tree, tree_run
from workbench.engine.integration.schemes import GeneralisedAlpha, RungeKutta8
from workbench.engine.objectives.quantities import Coordinate, Deviation, Slopes, StoredEnergy
from workbench.engine.objectives.reductions import NodeWeight
from workbench.engine.sensitivity.discrete_adjoint import discrete_adjoint, parameter_gradient
from workbench.engine.tree._kernels.forces import look_linearised
from workbench.engine.tree._kernels.tables import tree_work
from workbench.engine.tree.compiled import tree_compiled, tree_on_grid

pytestmark = pytest.mark.slow

EXACT = 1e-9  # relative to the largest entry; a complex step through 12 implicit steps
DIFFERENCES = 1e-7
ROUNDING = 1e-12  # of an objective, divided by the step of the differences
SCHEME = GeneralisedAlpha(tolerance=1e-15)
TIMES = np.linspace(0.0, 0.048, 13)


@dataclass(frozen=True, kw_only=True)
class Mixed:
    """a . velocity + b . acceleration + c . state, weighted over two nodes: an objective and its quantity."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray

    @property
    def quantity(self):
        return self

    def of(self, v, w):
        n = len(self.a)
        return v[:n] @ self.a + v[n:] @ self.c + w[:n] @ self.b

    def value(self, r):
        return sum(
            part.weight * self.of(r.nodes.velocity[part.node], r.nodes.rate[part.node])
            for part in self.weights(r)
        )

    def weights(self, r):
        last = len(r.times) - 1
        return (NodeWeight(last, 2.0), NodeWeight(last // 2, 1.0))

    def slopes(self, r, node):
        return Slopes(velocity=self.a, acceleration=self.b, states=self.c)

    def rate_slopes(self, r, node):
        return Slopes()


def mixed(rng, parts):
    n = len(parts.arrays["column"])
    return Mixed(a=rng.normal(size=n), b=0.1 * rng.normal(size=n), c=rng.normal(size=len(parts.states)))


def twin(parts, density, direction, guess):
    """Velocities and rates at all nodes for density + i tiny direction: the scheme in plain numpy.

    guess: (nodes, n) rates from which every node is solved; of several solutions of a step it takes that one.
    """
    tables = tree_on_grid(parts, density, TIMES)
    work, smooth = tree_work(tables, len(parts.states)), Complex(parts, tables)
    alpha = (density + TINY * 1j * direction)[parts.order]
    power = parts.power[parts.order]
    smooth.tables = smooth.tables._replace(scale=alpha**power)
    am, af, gamma, beta = SCHEME.numbers
    c, h = (1.0 - af) / (1.0 - am), TIMES[1]
    q, v = (np.asarray(x, complex) for x in parts.start)
    n = len(v)

    def solved(node, matrix, w, state):
        for step in range(60):
            if step and step % 10 == 0:  # slopes of the node before led nowhere
                matrix = newton_matrix(node, *state(w), w)
            move = -np.linalg.solve(matrix, smooth.residual(node, *state(w), w))
            w = w + move
            ease = 1.0 if step < 30 else 100.0  # stiff elements: rounding of large forces
            if np.abs(move.real).max() < ease * 1e-14 * np.abs(w.real).max() and (
                np.abs(move.imag).max() <= ease * 1e-13 * max(np.abs(w.imag).max(), 1e-40)
            ):
                return w
        raise AssertionError("the twin's iteration did not settle")

    def slopes(node, q, v, w):
        look_linearised(tables, work, node, q.real.copy(), v.real.copy(), w.real.copy())
        return work.m.copy(), work.k.copy(), work.c.copy()

    def newton_matrix(node, q, v, w):
        m, k, d = slopes(node, q, v, w)
        return m + h * gamma * c * d + h * h * beta * c * k if node else m

    w = solved(0, newton_matrix(0, q, v, 0 * v), np.zeros(n, complex), lambda w: (q, v))
    a, out = w, [(v, w)]
    for node in range(1, len(TIMES)):
        base = (af * w - am * a) / (1.0 - am)

        def state(w1, q=q, v=v, a=a, base=base):
            a1 = base + c * w1
            d = h * v + h * h * ((0.5 - beta) * a + beta * a1)
            return times_exponential(tables, q, d), v + h * ((1.0 - gamma) * a + gamma * a1)

        w1 = guess[node].astype(complex)
        w1 = solved(node, newton_matrix(node, *state(w1), w1), w1, state)
        q, v = state(w1)
        a, w = base + c * w1, w1
        out.append((v, w))
    return out


@pytest.mark.parametrize("scheme", [SCHEME, GeneralisedAlpha()], ids=["to rounding", "as it is"])
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_the_gradient_by_density_is_exact(first, scheme):
    """200 random trees with every element; also as Newton's method stops by itself."""
    for seed in range(first, first + 20):
        is_exact(seed, scheme)


def is_exact(seed, scheme):
    rng = np.random.default_rng(100 + seed)
    system = random_tree(rng, count=4 + seed % 4, first=seed % 7)
    parts = tree_compiled(system)
    density, direction = rng.uniform(0.2, 1.0, 12), rng.normal(size=12)
    run = tree_run(parts.system, density, TIMES, scheme)
    objective = mixed(rng, parts)
    nodes = twin(parts, density, direction, run.nodes.rate)
    exact = sum(part.weight * objective.of(*nodes[part.node]) for part in objective.weights(run))
    found = discrete_adjoint(run, objective)
    assert abs(objective.value(run) - exact.real) < 1e-10 * abs(exact.real), seed
    scale = max(abs(exact.imag / TINY), np.abs(found * direction).max())
    assert abs(found @ direction - exact.imag / TINY) < EXACT * scale, seed


def test_no_gradient_of_a_thousand_designs_is_not_a_number():
    """100 designs each of 10 random trees, members gone, thin and thick."""
    for seed in range(10):
        rng = np.random.default_rng(700 + seed)
        system = random_tree(rng, count=4 + seed % 4, first=seed % 7)
        objective = mixed(rng, tree_compiled(system))
        for _ in range(100):
            density = np.where(rng.random(12) < 0.2, 0.0, 10.0 ** rng.uniform(-9.0, 0.0, 12))
            found = discrete_adjoint(tree_run(system, density, TIMES), objective)
            assert np.isfinite(found).all(), (seed, density)


def along(f, step):
    """Derivative at 0 by central differences of fourth order."""
    return (8.0 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12.0 * step)


def test_gradients_by_every_parameter_are_those_of_differences():
    rng = np.random.default_rng(7)
    system = random_tree(rng, count=6, first=0)
    while not (system.couplings and system.spherical_springs and len(system.springs) > 1):
        system = random_tree(rng, count=6, first=0)
    parts, density = tree_compiled(system), rng.uniform(0.5, 1.0, 12)
    objective = mixed(rng, parts)
    found = parameter_gradient(tree_run(system, density, TIMES, SCHEME), objective)
    size = abs(objective.value(tree_run(system, density, TIMES, SCHEME)))
    # given numbers in place of those taken from the start, so that one changes at a time
    q = parts.start[0]
    rests = [q[parts.coordinates[s.body].start + s.coordinate] for s in system.springs]
    as_drawn = system  # its tables go with it
    system = replace(
        system, springs=tuple(replace(s, rest=r) for s, r in zip(system.springs, rests, strict=True))
    )

    def value(changed, start=None):
        return objective.value(tree_run(changed, density, TIMES, SCHEME, keep=False, start=start))

    def check(analytic, change, step):
        expected = along(lambda e: value(change(e)), step)
        assert analytic == pytest.approx(expected, rel=DIFFERENCES, abs=ROUNDING * size / step)

    def with_one(name, index, **change):
        parts = list(getattr(system, name))
        parts[index] = replace(parts[index], **change)
        return replace(system, **{name: tuple(parts)})

    for i, parameter in ((0, "k"), (0, "c"), (1, "k1"), (1, "knee"), (2, "gap")):
        law = system.members[i].law
        row = law.names.index(parameter)
        check(
            found.law[row, i],
            lambda e, i=i, law=law, p=parameter: with_one(
                "members", i, law=replace(law, **{p: getattr(law, p) + e})
            ),
            1e-3,
        )
    check(found.natural_length[0], lambda e: with_one("members", 0, natural_length=1.0 + e), 1e-4)
    for i, member in enumerate(system.members):
        for name, slope in (("point_a", found.point_a[i]), ("point_b", found.point_b[i])):
            aim = rng.normal(size=3)
            check(
                slope @ aim,
                lambda e, i=i, name=name, m=member, aim=aim: with_one(
                    "members", i, **{name: tuple(np.asarray(getattr(m, name)) + e * aim)}
                ),
                1e-4,
            )
    for row, name in enumerate(("k", "c", "rest", "k_stop", "upper", "lower", "torque")):
        check(
            found.spring[row, 0],
            lambda e, name=name: with_one("springs", 0, **{name: getattr(system.springs[0], name) + e}),
            1e-4,
        )
    for row, name in enumerate(("k", "c")):
        check(
            found.spherical_spring[row, 0],
            lambda e, name=name: with_one(
                "spherical_springs", 0, **{name: getattr(system.spherical_springs[0], name) + e}
            ),
            1e-3,
        )
        check(
            found.coupling[row, 0],
            lambda e, name=name: with_one("couplings", 0, **{name: getattr(system.couplings[0], name) + e}),
            1e-3,
        )
    rows = {"cap": 6, "slip": 7, "release": 8, "tau": 9, "eps": 10, "hold": 11}
    for u, bushing in enumerate(system.bushings):
        names = [name for name in rows if getattr(bushing, name) is not None]
        for name in names if bushing.breakable else [n for n in names if n != "tau"]:
            check(
                found.bushing[rows[name], u],
                lambda e, u=u, name=name, b=bushing: with_one("bushings", u, **{name: getattr(b, name) + e}),
                1e-4,
            )
        for name, first in (("k", 0), ("c", 3), ("preload", 12)):
            aim = rng.normal(size=3)
            check(
                found.bushing[first : first + 3, u] @ aim,
                lambda e, u=u, name=name, b=bushing, aim=aim: with_one(
                    "bushings", u, **{name: tuple(np.asarray(getattr(b, name)) + e * aim)}
                ),
                1e-3,
            )
    for i, body in enumerate(system.bodies):
        check(found.mass[i], lambda e, i=i, b=body: with_one("bodies", i, mass=b.mass + e), 1e-3)
        turn = rng.normal(size=3)
        check(
            found.centre[i] @ turn,
            lambda e, i=i, b=body, t=turn: with_one("bodies", i, centre=tuple(np.asarray(b.centre) + e * t)),
            1e-4,
        )
        change = rng.normal(size=(3, 3))
        change = change + change.T
        check(
            (found.inertia[i] * change).sum(),
            lambda e, i=i, b=body, c=change: with_one("bodies", i, inertia=np.asarray(b.inertia) + e * c),
            1e-4,
        )
    dv = rng.normal(size=parts.size)
    by_start = np.concatenate([found.velocity, found.state])
    expected = along(lambda e: value(system, (q, parts.start[1] + e * dv)), 1e-4)
    assert by_start @ dv == pytest.approx(expected, rel=DIFFERENCES)
    dq = np.zeros(parts.size)
    dq[: len(found.position)] = rng.normal(size=len(found.position))
    assert parts.system is as_drawn
    tables = tree_on_grid(parts, density, TIMES)
    expected = along(
        lambda e: value(system, (times_exponential(tables, q, e * dq).real, parts.start[1])), 1e-4
    )
    assert found.position @ dq[: len(found.position)] == pytest.approx(expected, rel=DIFFERENCES)


def test_tangents_evaluated_again_give_the_same_gradient():
    rng = np.random.default_rng(3)
    system = random_tree(rng, count=5)
    parts = tree_compiled(system)
    density, objective = rng.uniform(0.5, 1.0, 12), mixed(rng, parts)
    kept, lean = (
        discrete_adjoint(tree_run(parts.system, density, TIMES, SCHEME, keep=keep), objective)
        for keep in (True, False)
    )
    assert lean == pytest.approx(kept, rel=1e-9, abs=1e-12 * np.abs(kept).max())


@pytest.mark.parametrize("seed", range(3))
def test_views_and_stored_energy_have_exact_slopes(seed):
    """Deviation, Coordinate and StoredEnergy: rates along the run, slopes by small motions and velocities."""
    rng = np.random.default_rng(20 + seed)
    system = random_tree(rng, count=6, first=seed)
    parts, density = tree_compiled(system), rng.uniform(0.5, 1.0, 12)
    run = tree_run(system, density, TIMES, SCHEME)
    moving = [body.name for body in system.bodies]
    quantities = (
        Deviation(
            bodies=(moving[2], moving[4]), reference=moving[1], shares=(1.0, 2.0), weights=(1.0, 2.0, 3.0)
        ),
        Coordinate(bodies=(moving[3],), direction=(0.3, -0.5, 0.8)),
        StoredEnergy(),
    )
    node, tables = 5, run.tables
    q, v, zero = run.nodes.position[node], run.nodes.velocity[node], np.zeros(parts.size)
    for quantity in quantities:
        slopes, turning = quantity.slopes(run, node), quantity.rate_slopes(run, node)
        direction = np.zeros(parts.size)
        direction[: run.size] = rng.normal(size=run.size)

        def at(e, dq, dv, quantity=quantity):
            """Value and rate at a state moved from that of the node, on a grid with the same start."""
            moved = replace(run, nodes=run.nodes._replace(
                position=run.nodes.position.copy(), velocity=run.nodes.velocity.copy()), memo={})  # fmt: skip
            moved.nodes.position[node] = times_exponential(tables, q, e * dq).real
            moved.nodes.velocity[node] = v + e * dv
            return np.array([quantity.values(moved)[node], quantity.rates(moved, np.array([node]))[0]])

        by_q = along(lambda e, f=at, d=direction: f(e, d, zero), 1e-4)
        by_v = along(lambda e, f=at, d=direction: f(e, zero, d), 1e-4)
        by_t = along(lambda e, f=at: f(e, v * (np.arange(parts.size) < run.size), zero), 1e-4)
        d = direction[: run.size]
        scale = 1.0 + abs(by_q[1])
        assert slopes.position @ d == pytest.approx(by_q[0], rel=1e-8, abs=1e-8)
        assert turning.position @ d == pytest.approx(by_q[1], rel=1e-8, abs=1e-8 * scale)
        assert turning.velocity @ d == pytest.approx(by_v[1], rel=1e-8, abs=1e-8 * scale)
        assert quantity.rates(run, np.array([node]))[0] == pytest.approx(by_t[0], rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_gradients_of_order_8_are_those_of_differences(seed):
    """By density, start and acceleration seeds, with every element; smooth over the step taken."""
    rng = np.random.default_rng(40 + seed)
    system = random_tree(rng, count=5, first=seed)
    parts = tree_compiled(system)
    density, objective = rng.uniform(0.5, 1.0, 12), mixed(rng, parts)
    run = tree_run(parts.system, density, TIMES, RungeKutta8())
    found = parameter_gradient(run, objective)
    assert discrete_adjoint(run, objective) == pytest.approx(found.density, rel=1e-12, abs=1e-12)
    q, v = parts.start
    turn, push = np.zeros(parts.size), rng.normal(size=parts.size)
    turn[: run.size] = rng.normal(size=run.size)
    aim = rng.normal(size=12)

    def value(e_density, e_q, e_v):
        start = times_exponential(run.tables, q, e_q * turn).real, v + e_v * push
        return objective.value(
            tree_run(parts.system, density + e_density * aim, TIMES, RungeKutta8(), start=start)
        )

    size = abs(value(0, 0, 0))
    by_v = np.concatenate([found.velocity, found.state])
    for analytic, f in (
        (found.density @ aim, lambda e: value(e, 0, 0)),
        (found.position @ turn[: run.size], lambda e: value(0, e, 0)),
        (by_v @ push, lambda e: value(0, 0, e)),
    ):
        assert analytic == pytest.approx(along(f, 1e-4), rel=DIFFERENCES, abs=ROUNDING * size / 1e-4)

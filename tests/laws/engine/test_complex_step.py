"""The discrete adjoint against complex step through the whole scheme: exact to rounding, with and without
joints."""

import numpy as np
import pytest

from studies import three_body, two_body
from workbench.engine import (
    Belt,
    Body,
    Deviation,
    GeneralisedAlpha,
    JointSpring,
    Member,
    PrismaticJoint,
    Spring,
    System,
    Terminal,
    gradient,
    simulate,
)
from workbench.engine.integration.loops import alpha_loop
from workbench.engine.planar._kernels.tables import work_space
from workbench.engine.planar.compiled import compiled, on_grid
from workbench.engine.planar.equations import SampledEquations
from workbench.engine.planar.start import check_start

pytestmark = pytest.mark.slow

EXACT = 1e-12
TINY = 1e-30


class ComplexEquations(SampledEquations):
    """The same equations with every table and work array complex."""

    def __init__(self, parts, tables):
        super().__init__(parts, tables)
        self.tables = tables._replace(
            **{name: part.astype(complex) for name, part in tables._asdict().items() if part.dtype == float}
        )
        self.work = work_space(self.tables, complex)
        self.force, self.stiffness, self.damping = self.work.force, self.work.k, self.work.c
        self.constraint, self.jacobian = self.work.phi, self.work.phi_q
        self._z = self._z.astype(complex)


def by_complex_step(system, density, direction, objective, t_end, steps):
    """dG/dalpha . direction from one run with alpha + i tiny direction."""
    parts = compiled(system)
    scheme = GeneralisedAlpha()
    times = np.linspace(0.0, t_end, steps + 1)
    tables = on_grid(parts, density, times)
    q, v, _ = check_start(parts, tables)
    run = simulate(system, density, t_end, steps, scheme=scheme)
    bumped = tables._replace(scale=tables.scale + TINY * 1j * direction[parts.order])
    equations = ComplexEquations(parts, bumped)
    # consistent complex accelerations: M w + F + Phi_q^T lambda = 0 with the real run's constraint side
    n, m = len(q), len(tables.row)
    equations.look(0, q.astype(complex), v.astype(complex), np.zeros(m, complex))
    matrix = np.zeros((n + m, n + m), complex)
    matrix[:n, :n] = equations.mass
    matrix[:n, n:] = equations.jacobian.T
    matrix[n:, :n] = equations.jacobian
    right = np.concatenate([-equations.force, equations.jacobian @ run.acceleration[0]])
    start = np.linalg.solve(matrix, right)
    nodes = alpha_loop(
        equations, scheme, times, (q.astype(complex), v.astype(complex), start[:n], start[n:]), 0.0
    )
    state = nodes.position[-1]
    slopes = objective.quantity.slopes(run, len(times) - 1)
    return float(slopes.position @ state.imag / TINY), run


def small_system():
    """A slider with a swinging bar: prismatic joint, joint spring with stops, springs with dampers, belts."""
    slider = Body(name="slider", mass=2.0, inertia=0.2)
    bar = Body(name="bar", mass=1.0, inertia=0.1, position=(0.3, -0.2, -0.4), velocity=(0.2, 0.1, 1.0))
    laws = (Spring(k=80.0), Spring(k=30.0, c=1.0), Belt(k1=200.0, k2=60.0, knee=0.02, width=0.01))
    members = tuple(
        Member(
            a="bar", b="slider" if i % 2 else "ground", point_a=(0.1 * i, 0.05), point_b=(0.5, 0.1 * i - 0.2),
            law=laws[i % 3], natural_length=0.35, offset=0.05,
        )
        for i in range(6)
    )  # fmt: skip
    return System(
        bodies=(slider, bar), members=members, joints=(PrismaticJoint(a="slider", b="ground"),),
        springs=(JointSpring(a="bar", b="slider", k=2.0, c=0.1, k_stop=20.0, upper=0.1, lower=0.1),),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("system", "bodies", "reference"),
    [
        (two_body.problem("C").system, ("1",), "2"),
        (three_body.problem().system, ("1", "3"), "2"),
        (small_system(), ("bar",), "slider"),
    ],
    ids=["two bodies", "revolute joint", "slider, damper, belts, stops"],
)
def test_discrete_adjoint_is_complex_step_through_the_scheme(system, bodies, reference):
    density = np.full(len(system.members), 0.3)
    direction = np.random.default_rng(5).normal(size=len(density))
    objective = Terminal(quantity=Deviation(bodies=bodies, reference=reference))
    expected, run = by_complex_step(system, density, direction, objective, 0.2, 50)
    found = gradient(system, density, run, objective)
    error = abs(found @ direction - expected) / (np.linalg.norm(found) * np.linalg.norm(direction))
    assert error < EXACT
    assert abs(expected) > 0.0

"""Small random layouts of two bodies whose response or material is limited by what happens along the runs."""

import numpy as np

from workbench.engine import (
    Body,
    Deviation,
    Load,
    Maximum,
    Member,
    PointAcceleration,
    PointSpeed,
    Spring,
    System,
)
from workbench.engine.layout.formulation.limits import Limit
from workbench.engine.layout.formulation.material import least_material
from workbench.engine.layout.formulation.transient import Scenario, transient_problem

DEVIATION = Deviation(bodies=("1",), reference="2")
RESPONSE = Maximum(quantity=DEVIATION, refine=False)


def scenarios(seed):
    """8 to 14 springs between two bodies, pushed and turned in one to three ways."""
    rng = np.random.default_rng(seed)
    members = int(rng.integers(8, 15))
    inner, outer = rng.uniform(-0.4, 0.4, (members, 2)), rng.uniform(-1.2, 1.2, (members, 2))
    law = Spring(k=rng.uniform(0.5, 2.0) * 4e3)
    springs = tuple(
        Member(a="1", point_a=tuple(a), b="2", point_b=tuple(b), law=law)
        for a, b in zip(inner, outer, strict=True)
    )
    some = []
    for case in range(int(rng.integers(1, 4))):
        angle, turn = rng.uniform(0, 2 * np.pi), rng.uniform(-20, 20)
        push = Load(body="2", force=(19600 * np.cos(angle), 19600 * np.sin(angle)), torque=6000 * turn)
        system = System(
            bodies=(Body(name="1", mass=60.0, inertia=10.0), Body(name="2", mass=2000.0, inertia=6000.0)),
            members=springs, loads=(push,),
        )  # fmt: skip
        some.append(Scenario(system=system, objective=RESPONSE, t_end=0.6, steps=60, name=f"case {case}"))
    return some


def limited(seed, kind):
    """A problem, its limits and scenarios: the least "response" under a budget, or the least "material".

    The limits are a little below, or above, what the uniform layout reaches.
    """
    some = scenarios(seed)
    members = len(some[0].system.members)
    bare = transient_problem(some, start=0.4, budgets=[], lower=1e-3)
    runs = [run for _, run in bare.simulated(np.full(members, 0.4))]

    def limit(name, objective, share):
        return Limit(name=name, objective=objective, at_most=share * max(objective.value(r) for r in runs))

    speed = Maximum(quantity=PointSpeed(body="1", point=(0.3, 0.1)), refine=False)
    if kind == "material":
        limits = [limit("displacement", RESPONSE, 0.8), limit("speed", speed, 1.1)]
        return (
            least_material(transient_problem(some, start=0.6, budgets=[], lower=1e-3, limits=limits)),
            limits, some,
        )  # fmt: skip
    push = Maximum(quantity=PointAcceleration(body="1", point=(0.1, 0.1)), refine=False)
    limits = [limit("acceleration", push, 0.95), limit("speed", speed, 0.98)]
    budgets = [(np.ones(members), 0.4 * members)]
    return (
        transient_problem(some, start=0.4, budgets=budgets, lower=1e-3, limits=limits), limits, some,
    )  # fmt: skip

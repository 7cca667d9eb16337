"""What a vehicle with an occupant costs per step, beside Pinocchio's derivatives of the inverse dynamics."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.peers.engine.tree.test_pinocchio import peer_model
from workbench.engine import (
    Belt,
    CoordinateSpring,
    Deviation,
    Floating,
    Maximum,
    Revolute,
    SpatialBody,
    SpatialBushing,
    SpatialMember,
    Spherical,
    SphericalSpring,
    TreeSystem,
    Universal,
    gradient,
    simulate,
)

pytestmark = pytest.mark.bench

STEPS = 300
Y = (0.0, 1.0, 0.0)


def vehicle(members=360, bushings=42):
    """A chassis on four corners with wheels, an occupant of 17 bodies, seven flaps; nv = 57."""
    rng, bodies = np.random.default_rng(0), []

    def add(name, parent, joint, at, mass, inertia):
        bodies.append(
            SpatialBody(
                name=name, parent=parent, joint=joint, at=at, mass=mass, centre=(0, 0, 0.05), inertia=inertia
            )
        )

    add("chassis", "ground", Floating(position=(0, 0, 1.0)), (0, 0, 0), 2400.0, (1240, 3399, 4105))
    for i, (x, y) in enumerate(((1.6, 0.9), (1.6, -0.9), (-1.6, 0.9), (-1.6, -0.9))):
        add(f"corner{i}", "chassis", Revolute(axis=(1, 0, 0)), (x, y, -0.3), 105.0, (4, 6, 4))
        add(f"wheel{i}", f"corner{i}", Revolute(axis=Y), (0, 0.1, 0), 30.0, (1, 2, 1))
    add("pelvis", "ground", Floating(position=(0, 0, 1.635)), (0, 0, 0), 8.6, (0.05,) * 3)
    for name, parent, height, mass in (
        ("belly", "pelvis", 0.15, 12.5), ("chest", "belly", 0.22, 12.3), ("neck", "chest", 0.25, 1.2),
        ("head", "neck", 0.1, 4.1),
    ):  # fmt: skip
        add(name, parent, Spherical(), (0, 0, height), mass, (0.02,) * 3)
    two = Universal(axes=(Y, (1, 0, 0)))
    for s in (-1, 1):
        add(f"upper{s}", "chest", two, (0, 0.18 * s, 0.15), 2.1, (0.0125,) * 3)
        add(f"fore{s}", f"upper{s}", Revolute(axis=Y), (0.25, 0, -0.13), 1.25, (0.0065,) * 3)
        add(f"hand{s}", f"fore{s}", Universal(axes=(Y, (0, 0, 1))), (0.27, 0, 0.03), 0.5, (0.001,) * 3)
        add(f"thigh{s}", "pelvis", two, (0, 0.1 * s, 0), 11.0, (0.2,) * 3)
        add(f"shank{s}", f"thigh{s}", Revolute(axis=Y), (0.3, 0, -0.3), 3.3, (0.04,) * 3)
        add(f"foot{s}", f"shank{s}", Revolute(axis=Y), (0, 0, -0.44), 1.05, (0.005,) * 3)
    for i in range(7):
        add(f"flap{i}", "chassis", Revolute(axis=Y), (0.3 * i - 1, 0, 0.2), 5.0, (0.05,) * 3)
    belts = tuple(
        SpatialMember(
            a=("pelvis", "belly", "chest")[i % 3], b="chassis", point_a=tuple(0.15 * rng.normal(size=3)),
            point_b=tuple(0.5 * rng.normal(size=3) + (0, 0, 0.6)), law=Belt(width=0.005),
        )
        for i in range(members)
    )  # fmt: skip
    holds = [
        SpatialBushing(
            a="pelvis", b="chassis", point_b=(0, 0, 0.635), k=1e4, c=700.0, cap=1e3, preload=(0, 0, 755)
        )
    ]
    holds += [SpatialBushing(a=f"wheel{i}", k=3e5, c=2e3, point_b=(0, 0, 0.5)) for i in range(4)]
    others = [body.name for body in bodies if body.name not in ("chassis", "pelvis")]
    while len(holds) < bushings:
        i = len(holds)
        holds.append(
            SpatialBushing(
                a=others[i % len(others)], b=("pelvis", "chassis")[i % 2], k=500.0, c=5.0, cap=300.0
            )
        )
    springs = tuple(
        CoordinateSpring(body=b.name, coordinate=j, k=60.0, c=1.0, k_stop=500.0, upper=0.6, lower=0.6)
        for b in bodies
        if isinstance(b.joint, Revolute | Universal)
        for j in range(2 if isinstance(b.joint, Universal) else 1)
    )
    balls = tuple(
        SphericalSpring(body=b.name, k=300.0, c=10.0) for b in bodies if isinstance(b.joint, Spherical)
    )
    return TreeSystem(
        bodies=tuple(bodies), members=belts, bushings=tuple(holds), springs=springs, spherical_springs=balls
    )


def cpu(call, count=1):
    begin = time.process_time()
    for _ in range(count):
        call()
    return 1e6 * (time.process_time() - begin) / count


def test_a_vehicle_with_an_occupant_beside_pinocchio():
    pin = pytest.importorskip("pinocchio")
    system, density = vehicle(), np.full(360, 0.1)
    model, _ = peer_model(pin, system)
    data, q = model.createData(), pin.neutral(model)
    v = np.random.default_rng(1).normal(size=model.nv)
    objective = head_deviation()
    run = simulate(system, density, t_end=1e-3 * STEPS, steps=STEPS)
    gradient(system, density, run, objective)
    rows = []
    for _ in range(7):
        peer = cpu(lambda: pin.computeRNEADerivatives(model, data, q, v, v), 300)
        forward = cpu(lambda: simulate(system, density, t_end=1e-3 * STEPS, steps=STEPS)) / STEPS
        run = simulate(system, density, t_end=1e-3 * STEPS, steps=STEPS)
        back = cpu(lambda run=run: gradient(system, density, run, objective)) / STEPS
        rows.append((peer, forward, back, forward / peer, (forward + back) / peer))
    peer, forward, back, one, both = np.median(rows, axis=0)
    print(f"\n  nv = {model.nv}: a step {forward:.0f} us with tangents kept, its adjoint {back:.0f} us")
    print(f"  Pinocchio's derivatives {peer:.1f} us: {one:.1f} times, with gradient {both:.1f} (goal 12)")


FIRST = """
import sys, time
from tests.bench.test_bench_tree import head_deviation, vehicle
import numpy as np
from workbench.engine import gradient, simulate
begin, system, density = time.process_time(), vehicle(), np.full(360, 0.1)
run = simulate(system, density, t_end=0.01, steps=10)
gradient(system, density, run, head_deviation())
print(time.process_time() - begin)
"""


def head_deviation():
    return Maximum(quantity=Deviation(bodies=("head",), reference="chassis", weights=(1.0, 1.0, 1.0)))


def test_first_gradient_of_a_process(tmp_path):
    """Processor time on an empty cache, imports left out; the goal is 10 s."""
    print()
    for case in ("empty cache", "kernels cached"):
        out = subprocess.run(
            [sys.executable, "-c", FIRST], env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
            cwd=Path(__file__).parents[2], capture_output=True, text=True, check=True,
        )  # fmt: skip
        print(f"  first gradient of the vehicle, {case}: {float(out.stdout):.2f} s of processor time")

"""What a tree does not hold is not compiled, and changes nothing."""

import numpy as np
import pytest

from workbench.engine import (
    Coordinate,
    Floating,
    Maximum,
    Revolute,
    SpatialBody,
    SpatialMember,
    Spring,
    TreeSystem,
    gradient,
    simulate,
)
from workbench.engine.compiler.held import ABSENT, marked
from workbench.engine.tree import compiled

HELD = compiled.MAY_BE_ABSENT


def swing():
    bodies = (
        SpatialBody(name="base", joint=Floating(velocity=(0.1, 0.0, 0.0)), mass=2.0, inertia=(1.0, 1.2, 1.4)),
        SpatialBody(
            name="arm", parent="base", joint=Revolute(axis=(0, 1, 0), speed=1.0), at=(0.5, 0.0, 0.0),
            mass=1.0, centre=(0.2, 0.0, 0.0), inertia=(0.1, 0.2, 0.3),
        ),
    )  # fmt: skip
    members = tuple(
        SpatialMember(a="arm", b=b, point_a=(0.3, 0.1, 0.2), point_b=(0.0, 1.0, z), law=Spring(k=80.0, c=1.0))
        for b, z in (("base", 0.5), ("ground", 1.0), ("ground", -1.0))
    )
    return TreeSystem(bodies=bodies, members=members)


def test_an_absent_table_keeps_its_shape_and_tells_by_its_type():
    full, empty = np.ones((2, 3), np.int64), np.zeros((0, 3), np.int64)
    assert marked(full) is full
    assert marked(empty).shape == (0, 3)
    assert marked(empty).dtype == ABSENT


@pytest.mark.slow
def test_kernels_without_what_is_absent_give_the_same_numbers_to_the_bit(monkeypatch):
    """The same system compiled with the code of every element and without what it does not hold."""
    objective = Maximum(quantity=Coordinate(bodies=("arm",), direction=(0.0, 0.0, 1.0)))
    found = []
    for absent in (HELD, ()):
        monkeypatch.setattr(compiled, "MAY_BE_ABSENT", absent)
        run = simulate(swing(), np.ones(3), t_end=0.2, steps=20)
        kept = {name for name in HELD if run.parts.arrays[name].dtype != ABSENT}
        assert kept == (set(HELD) if not absent else {"pair"})
        found.append((run.position, run.velocity, gradient(run.system, run.density, run, objective)))
    for lean, full in zip(*found, strict=True):
        np.testing.assert_array_equal(lean, full)

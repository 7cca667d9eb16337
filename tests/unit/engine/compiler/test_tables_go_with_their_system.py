"""Tables of a system are kept as long as it lives, and no longer: a loop makes thousands of systems."""

from weakref import ref

import numpy as np
import pytest

from workbench.engine import Body, Member, Spring, System
from workbench.engine.natural.compiled import compiled as natural_compiled
from workbench.engine.natural.system import Distance, NaturalPoint, NaturalSystem
from workbench.engine.planar.compiled import compiled as planar_compiled
from workbench.engine.planar.compiled import on_grid
from workbench.engine.tree.compiled import tree_compiled
from workbench.engine.tree.joints import Spherical
from workbench.engine.tree.system import SpatialBody, TreeSystem


def _planar():
    spring = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))
    return System(bodies=(Body(name="mass", mass=1.0, inertia=1.0),), members=(spring,))


def _natural():
    fixed = NaturalPoint(name="O", position=(0, 0, 0), fixed=True)
    moving = NaturalPoint(name="P", position=(1, 0, 0), mass=1.0)
    return NaturalSystem(points=(fixed, moving), conditions=(Distance(a="O", b="P"),))


def _tree():
    return TreeSystem(bodies=(SpatialBody(name="bob", joint=Spherical(), mass=1.0, centre=(1.0, 0.0, 0.0)),))


@pytest.mark.parametrize(
    ("made", "compiled"),
    [(_planar, planar_compiled), (_natural, natural_compiled), (_tree, tree_compiled)],
    ids=["planar", "natural", "tree"],
)
def test_a_system_that_nobody_holds_goes_with_its_tables(made, compiled):
    system = made()
    tables = compiled(system)
    assert compiled(system) is tables
    assert tables.system is system
    # a table of numbers stands for all: the record itself takes no weak references
    gone, tables_gone = ref(system), ref(tables.start[0])
    del system, tables
    assert gone() is None
    assert tables_gone() is None


def test_samples_go_with_the_tables():
    system = _planar()
    parts = planar_compiled(system)
    on_grid(parts, np.ones(1), np.linspace(0.0, 1.0, 11))
    samples = ref(parts.samples["last"].motion)
    del system, parts
    assert samples() is None

"""What cut joints refuse, in words, and what they carry at rest."""

import numpy as np
import pytest

from tests.sample_loops import CRANK, DOWN, parallelogram
from tests.sample_trees import tree_run
from workbench.engine.errors import AssemblyError, InvalidSystem, NotConverged, NotSupported
from workbench.engine.integration.schemes import GeneralisedAlpha, RungeKutta8
from workbench.engine.tree.compiled import tree_compiled
from workbench.engine.tree.joints import Revolute, Universal
from workbench.engine.tree.loops.cuts import CutJoint
from workbench.engine.tree.restart import close_loops, restarted
from workbench.engine.tree.statics import equilibrium, modes
from workbench.engine.tree.system import SpatialBody, TreeSystem

NONE = np.zeros(0)
Y = (0.0, 1.0, 0.0)


def rod(name, length=1.0, joint=None, **change):
    return SpatialBody(
        name=name, joint=Revolute(axis=Y) if joint is None else joint, mass=1.0,
        centre=(0.0, 0.0, -0.5 * length), inertia=(0.1, 0.1, 0.01), **change,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"kind": "weld"}, "cut joint 'x-y' needs a kind of spherical, revolute, .* got 'weld'"),
        ({"b": "x"}, "cut joint 'x-x' joins body 'x' to itself"),
        ({"axis_a": (0.0, 0.0, 0.0)}, "cut joint 'x-y' needs an axis, got"),
        ({"kind": "universal"}, "cut joint 'x-y' needs axis_b, perpendicular to axis_a"),
        ({"length": -1.0}, "cut joint 'x-y' needs length > 0 m, got length=-1.0"),
    ],
)
def test_a_cut_joint_says_what_it_needs(change, said):
    with pytest.raises(InvalidSystem, match=said):
        CutJoint(**{"a": "x", "b": "y", "kind": "spherical", **change})


def test_systems_say_which_cut_joint_does_not_fit():
    cut = CutJoint(a="rod", b="nobody", kind="spherical")
    with pytest.raises(InvalidSystem, match="cut joint 'rod-nobody' refers to body 'nobody'"):
        TreeSystem(bodies=(rod("rod"),), cuts=(cut,))
    cut = CutJoint(a="rod", kind="spherical")
    with pytest.raises(InvalidSystem, match="two cut joints are called 'rod-ground'"):
        TreeSystem(bodies=(rod("rod"),), cuts=(cut, cut))
    with pytest.raises(InvalidSystem, match=r"cut joint 'rod-ground' needs length > 0 m, got length=0\.0"):
        tree_compiled(TreeSystem(bodies=(rod("rod"),), cuts=(CutJoint(a="rod", kind="distance"),)))
    held = CutJoint(a="rod", point_a=(0.0, 0.0, -1.0), point_b=(0.0, 0.0, -1.0), kind="spherical")
    with pytest.raises(InvalidSystem, match="cut joints leave no motion: 1 independent conditions on 1 vel"):
        tree_compiled(TreeSystem(bodies=(rod("rod"),), cuts=(held,)))


def test_an_open_loop_is_refused_with_its_gap_and_closed_on_request():
    rods = rod("a"), rod("b", at=(1.0, 0.0, 0.0)), rod("c", parent="a", at=DOWN)
    open_ = TreeSystem(
        bodies=rods,
        cuts=(
            CutJoint(
                a="c", b="b", point_a=DOWN, point_b=DOWN, kind="revolute", axis_a=(0.0, 1.0, 0.3), axis_b=Y
            ),
        ),
    )
    with pytest.raises(AssemblyError, match=r"cut joint 'c-b' is open at the start by 1 m and 0\.287 rad"):
        tree_compiled(open_)
    with pytest.raises(AssemblyError, match=r"cut joint 'c-b' stays open by .* m and 0.\d+ rad whatever"):
        close_loops(open_)
    far = parallelogram(0.4, closed=False)
    with pytest.raises(AssemblyError, match="is open at the start by") as refused:
        tree_compiled(far)
    assert refused.value.size > 0.1
    closed = close_loops(far, held=(("left", 0),))
    angles = {body.name: body.joint.angle for body in closed.bodies}
    assert angles == pytest.approx({"left": 0.4, "bar": -0.4, "right": 0.4}, abs=1e-12)
    assert [body.joint.speed for body in closed.bodies] == pytest.approx([1.0, -1.0, 1.0])
    assert close_loops(TreeSystem(bodies=rods)).bodies == rods


def test_parting_speeds_are_refused():
    apart = parallelogram(0.0, closed=False)
    with pytest.raises(AssemblyError, match="cut joint 'bar-right' parts at the start by 1 m/s"):
        tree_compiled(apart)
    with pytest.raises(
        AssemblyError, match="cut joint 'bar-right' parts by 1 m/s and 0 rad/s whatever the joints"
    ):
        close_loops(apart, held=(("left", 0), ("bar", 0), ("right", 0)))


def test_small_gaps_close_by_the_least_motion():
    near = parallelogram(0.3, right=0.301, speeds=(0.0, 0.0, 0.0), closed=False)
    q, v = tree_compiled(near).start
    assert 0.0 < np.abs(q - (0.3, -0.3, 0.301)).max() < 1e-3
    assert not v.any()
    again = restarted(near, q)
    assert again.cuts[0].axis_b == pytest.approx(Y)
    np.testing.assert_allclose(tree_compiled(again).start[0], q, atol=1e-12)


def test_runs_that_cut_joints_do_not_take():
    closed = parallelogram(0.3)
    with pytest.raises(NotSupported, match="order 8 holds no cut joints"):
        tree_run(closed, NONE, np.linspace(0.0, 0.1, 11), RungeKutta8())
    with pytest.raises(NotSupported, match=r"cut joints need rho <= 0\.99"):
        tree_run(closed, NONE, np.linspace(0.0, 0.1, 11), GeneralisedAlpha(rho=1.0))
    run = tree_run(closed, NONE, np.linspace(0.0, 0.1, 11))
    with pytest.raises(ValueError, match="system has no cut joint 'x'; it has bar-right"):
        run.cut_force("x")


def test_a_loop_that_is_redundant_at_the_start_alone_is_refused_with_its_condition():
    """Rods of 1 and 2 m in one plane, tips together: the tips' heights agree at the start only."""
    tip = CutJoint(a="short", b="long", point_a=DOWN, point_b=(0.0, 0.0, -2.0), kind="spherical")
    two = Universal(axes=(Y, (1.0, 0.0, 0.0)), speeds=(1.0, 0.0))
    swing = TreeSystem(
        bodies=(rod("short", joint=two), rod("long", 2.0, Revolute(axis=Y, speed=0.5), at=(0.0, 0.0, 1.0))),
        cuts=(tip,),
    )
    with pytest.raises(
        NotConverged, match=r"place of cut joint 'short-long' along . followed from the others"
    ):
        tree_run(swing, NONE, np.linspace(0.0, 0.5, 51))


def test_a_parallelogram_hangs_and_swings_like_its_pendulum():
    bar = 3.0
    found = equilibrium(parallelogram(0.4, bar=bar), NONE)
    assert [body.joint.angle for body in found.system.bodies] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    # two rods of length 1 and a bar that is carried: (2 m/3 + M) w^2 = (m + M) g
    first = modes(found.system, NONE)
    square = (CRANK + bar) * 9.81 / (2.0 * CRANK / 3.0 + bar)
    assert first.frequency == pytest.approx([np.sqrt(square) / (2.0 * np.pi)], rel=1e-9)
    assert first.shapes[0] / first.shapes[0, 1] == pytest.approx([-1.0, 1.0, -1.0], abs=1e-9)
    run = tree_run(found.system, NONE, np.linspace(0.0, 0.1, 11))
    assert np.abs(run.velocity).max() < 1e-9
    carried = run.cut_force("bar-right")
    np.testing.assert_allclose(carried.force, np.tile((0.0, 0.0, 0.5 * bar * 9.81), (11, 1)), atol=1e-8)
    assert np.abs(carried.moment).max() < 1e-8

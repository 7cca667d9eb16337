"""The saddle matrix as a band: the same runs and gradients as with dense factors."""

import numpy as np
import pytest

from tests.papers.engine.test_mechanisms import four_bars, rod
from workbench.engine import (
    Bushing,
    Coordinate,
    DistanceJoint,
    GeneralisedAlpha,
    Load,
    Member,
    RevoluteJoint,
    Spring,
    System,
    Terminal,
    gradient,
    simulate,
)
from workbench.engine.planar import runs
from workbench.engine.planar._kernels import saddle
from workbench.engine.planar.compiled import compiled

SAME = 1e-10  # of the largest entry of both gradients
MOVED = 1e-12  # of the extent: what velocities, accelerations and joint forces that differ move in a step
H = 2.5e-3  # s
SHARP = GeneralisedAlpha(
    tolerance=1e-12
)  # both ways are solved to rounding, which is eps/h^2 in accelerations
HALF = 0.5 * float(np.hypot(0.2, 0.05))  # m


def chain(rng, count, *, closed=False, redundant=False, damping=0.0, bushings=()):
    """A zigzag of rods of drawn masses on pins, springs to the next two, a load in the middle."""
    bodies, joints, members = [], [], []
    for i in range(count):
        start, end = (0.2 * i, 0.05 * (i % 2)), (0.2 * (i + 1), 0.05 * ((i + 1) % 2))
        bodies.append(rod(f"bar{i}", start, end, rng.uniform(0.5, 2.0))[0])
        held = {"b": "ground"} if i == 0 else {"b": f"bar{i - 1}", "point_b": (HALF, 0.0)}
        joints.append(RevoluteJoint(a=f"bar{i}", point_a=(-HALF, 0.0), **held))
        for over in (1, 2):
            ends = {"point_a": tuple(rng.uniform(-0.1, 0.1, 2)), "point_b": tuple(rng.uniform(-0.1, 0.1, 2))}
            law = Spring(k=rng.uniform(50.0, 200.0), c=damping)
            members.append(
                Member(a=f"bar{i}", b=f"bar{i - over}" if i >= over else "ground", law=law, **ends)
            )
    if closed:
        joints.append(RevoluteJoint(a=f"bar{count - 1}", b="ground", point_a=(HALF, 0.0), point_b=end))
    if redundant:  # the far end of the first rod stays at its length already
        joints.append(DistanceJoint(a="bar0", b="ground", point_a=(HALF, 0.0), name="one too many"))
    load = Load(body=f"bar{count // 2}", force=lambda t: (0.0, 5.0 * np.sin(20.0 * t)), point=(0.05, 0.0))
    return System(
        bodies=bodies, joints=joints, members=members, loads=(load,), bushings=bushings, gravity=(0.0, -9.81)
    )


def breakable(count):
    return (
        Bushing(
            a=f"bar{count // 2}", b=f"bar{count // 2 - 2}", point_a=(0.0, 0.02), point_b=(0.05, 0.0), k=200.0,
            c=1.0, cap=6.0, slip=0.03, release=0.08, width=0.01, eps=0.01,
        ),
    )  # fmt: skip


CASES = {
    "springs": lambda: chain(np.random.default_rng(821), 24),
    "a closed loop": lambda: chain(np.random.default_rng(822), 22, closed=True),
    "a redundant row": lambda: chain(np.random.default_rng(823), 20, redundant=True),
    "dampers": lambda: chain(np.random.default_rng(824), 20, damping=0.5),
    "a state": lambda: chain(np.random.default_rng(825), 20, damping=0.5, bushings=breakable(20)),
    "windows": lambda: four_bars(12),
}


def both_ways(monkeypatch, build):
    """The system with the band of its saddle matrix, and another one like it that is solved densely."""
    with monkeypatch.context() as patch:
        patch.setattr(saddle, "NARROW", np.inf)
        dense = build()
        assert compiled(dense).saddle is None
    band = build()
    assert compiled(band).saddle is not None
    return band, dense


@pytest.mark.parametrize("keep", [True, False])
@pytest.mark.parametrize("name", CASES)
def test_runs_and_gradients_are_those_of_dense_factors(monkeypatch, name, keep):
    if not keep:
        monkeypatch.setattr(runs, "KEEP", 0.0)  # the adjoint evaluates the tangents again
    band, dense = both_ways(monkeypatch, CASES[name])
    density = np.random.default_rng(826).uniform(0.2, 1.0, len(band.members))
    middle = band.free[len(band.free) // 2].name  # where the load acts
    ends = [
        Terminal(quantity=Coordinate(bodies=(middle,), direction=axis)) for axis in ((1.0, 0.0), (0.0, 1.0))
    ]
    mine, theirs = (simulate(s, density, 40 * H, 40, scheme=SHARP) for s in (band, dense))
    assert bool(mine.diagnosis.redundant_rows) is (name == "a redundant row")
    extent = np.abs(theirs.position).max()
    weights = {
        "position": 1.0,
        "velocity": H,
        "acceleration": H**2,
        "multiplier": H**2 / 0.5,
        "states": extent,
    }
    for part, weight in weights.items():
        off = np.abs(getattr(mine, part) - getattr(theirs, part)).max(initial=0.0)
        if part != "multiplier" or name != "a redundant row":
            assert weight * off <= MOVED * extent, part
    if len(density):
        assert mine.states.size == 0 or mine.states.max() > 1e-3
        one, other = (
            np.array([gradient(s, density, run, end) for end in ends])
            for s, run in ((band, mine), (dense, theirs))
        )
        assert np.abs(other).max() > 1e-6
        assert np.abs(one - other).max() <= SAME * np.abs(other).max()


def test_a_star_and_small_systems_are_solved_densely():
    spokes = [rod(f"spoke{i}", (0.0, 0.0), (np.cos(i), np.sin(i)))[0] for i in range(12)]
    pins = [
        RevoluteJoint(a=f"spoke{i}", b="spoke0", point_a=(-0.5, 0.0), point_b=(-0.5, 0.0))
        for i in range(1, 12)
    ]
    assert compiled(System(bodies=spokes, joints=pins)).saddle is None
    assert compiled(chain(np.random.default_rng(827), 3)).saddle is None


def test_systems_of_one_structure_share_the_band_and_no_others():
    one, other = (chain(np.random.default_rng(seed), 24) for seed in (829, 830))
    assert compiled(one).saddle is compiled(other).saddle is not None
    longer, closed = chain(np.random.default_rng(829), 25), chain(np.random.default_rng(829), 24, closed=True)
    assert len({id(compiled(system).saddle) for system in (one, longer, closed)}) == 3


def test_a_run_goes_on_to_the_bit():
    system, times = chain(np.random.default_rng(828), 24), np.linspace(0.0, 0.1, 41)
    whole = simulate(system, np.ones(48), times=times)
    half = simulate(system, np.ones(48), times=times[:21])
    rest = simulate(system, np.ones(48), times=times[20:], start=half.state())
    assert (rest.position == whole.position[20:]).all()

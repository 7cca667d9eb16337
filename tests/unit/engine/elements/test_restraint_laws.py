"""Webbing, locking reels and vented airbags: what they hold, what they give back, slopes by complex step."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from workbench.engine import (
    Airbag,
    Body,
    Floating,
    LockingRetractor,
    Member,
    NaturalPoint,
    NaturalSystem,
    PointMember,
    SpatialBody,
    SpatialMember,
    StoredEnergy,
    System,
    Terminal,
    TreeSystem,
    VentedAirbag,
    Webbing,
    gradient,
    simulate,
)
from workbench.engine.elements import locking_retractor, vented_airbag, webbing
from workbench.engine.elements.law_series import law_series
from workbench.engine.elements.table import PARAMETERS

TINY = 1e-30
EXACT = 1e-11  # of the largest slope: the same operations in another order
FILES = {Webbing: webbing, LockingRetractor: locking_retractor, VentedAirbag: vented_airbag}
RISING = {"rise": 0.1, "returned": 0.2, "speed": 0.5, "width": 0.02}  # at 0.2 s half way
LAWS = (
    Webbing(k=3e3, slack=0.02, limit=200.0, pull=0.05, fires=0.15, **RISING),
    LockingRetractor(k=3e3, locks=0.15, paid=-0.02, limit=200.0, **RISING),
    VentedAirbag(c1=2.0, deploy=0.15, **RISING),
)  # fmt: skip


def called(kernel):
    """Only kernels may call an inner one."""
    return njit(error_model="numpy")(lambda *arguments: kernel(*arguments))


def force(law, delta, rate=0.0, t=1.0):
    return float(law_series([law], np.array([[delta]]), np.array([[rate]]), np.array([t])).force[0, 0])


def test_webbing_has_slack_a_limit_and_a_pretensioner():
    belt = Webbing(k=1e5, slack=0.02, limit=4e3)
    assert force(belt, 0.015) == 0.0
    assert force(belt, 0.04) == pytest.approx(2e3)
    assert force(belt, 0.30) == pytest.approx(4e3)
    assert force(belt, -0.5) == 0.0
    wound = replace(belt, pull=0.05, fires=0.1, rise=0.02)
    assert force(wound, 0.0, t=0.1) == 0.0
    assert force(wound, 0.0, t=0.11) == pytest.approx(1e5 * (0.025 - 0.02))  # half wound in
    assert force(wound, 0.0, t=0.12) == pytest.approx(3e3)
    assert force(replace(belt, returned=0.3, speed=0.2), 0.04, rate=-0.2) == pytest.approx(600.0)


def test_a_reel_pays_out_until_it_locks():
    reel = LockingRetractor(k=1e5, locks=0.5, tension=12.0, paid=0.03, rise=0.02)
    assert force(reel, 0.2, rate=1.0, t=0.5) == 12.0
    assert force(reel, 0.05, t=0.6) == pytest.approx(2012.0)
    assert force(reel, 0.02, t=0.6) == 12.0  # less is out than when it locked
    assert force(reel, 0.5, t=0.6) == pytest.approx(4012.0)
    assert force(reel, 0.05, rate=-0.3, t=0.6) == pytest.approx(212.0)


def test_a_vented_bag_is_the_sealed_one_on_the_way_in():
    sealed, vented = Airbag(), VentedAirbag(returned=0.25, speed=0.1)
    for delta in (0.02, -0.005, -0.06, -0.13, -0.2):
        assert force(vented, delta, rate=-1.0) == force(vented, delta) == force(sealed, delta)
        assert force(vented, delta, rate=0.1) == pytest.approx(0.25 * force(sealed, delta))
    assert force(VentedAirbag(deploy=0.5), -0.1, t=0.5) == 0.0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_slopes_are_those_of_a_complex_step(law):
    file, r = FILES[type(law)], np.random.default_rng(3)
    forces, parameter_slopes = called(file.forces), called(file.parameter_slopes)

    def kernel(table, delta, rate):
        f, fd, fv = (np.zeros(1, complex) for _ in range(3))
        forces(table, 0, 1, np.array([delta]), np.array([rate]), 0.2 + 0j, f, fd, fv)
        return f[0], fd[0].real, fv[0].real

    seen = set()
    for delta, rate in zip(r.uniform(-0.12, 0.12, 400), r.uniform(-0.7, 0.7, 400), strict=True):
        table = np.zeros((PARAMETERS, 1), complex)
        table[: len(law.parameters), 0] = law.parameters
        f, by_delta, by_rate = kernel(table, delta + 0j, rate + 0j)
        size = EXACT * max(1.0, abs(by_delta), abs(by_rate), abs(f))
        assert by_delta == pytest.approx(kernel(table, delta + 1j * TINY, rate + 0j)[0].imag / TINY, abs=size)
        assert by_rate == pytest.approx(kernel(table, delta + 0j, rate + 1j * TINY)[0].imag / TINY, abs=size)
        assert by_rate >= 0.0  # never drives what moves
        dp = np.zeros(PARAMETERS)
        parameter_slopes(table.real.copy(), 0, delta, rate, 0.2, dp)
        for row, name in enumerate(law.names):
            if name:
                moved = table.copy()
                moved[row, 0] += 1j * TINY
                exact = kernel(moved, delta + 0j, rate + 0j)[0].imag / TINY
                assert dp[row] == pytest.approx(exact, abs=EXACT * max(1.0, abs(exact))), name
                seen |= {name} if abs(exact) > 1e-6 else set()
    assert seen == {name for name in law.names if name}  # each of them was met where it acts


@pytest.mark.parametrize("returned", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_a_cycle_gives_back_the_share_that_was_asked_for(law, returned):
    law = replace(law, returned=returned, **({"tension": 0.0} if isinstance(law, LockingRetractor) else {}))
    sign = -1.0 if isinstance(law, VentedAirbag) else 1.0
    way, times = sign * np.linspace(-0.1, 0.12, 4001)[:, None], np.ones(4001)
    there = law_series([law], way, np.full_like(way, sign * 0.6), times).force
    back = law_series([law], way, np.full_like(way, -sign * 0.6), times).force
    put_in, got_out = (np.trapezoid(f[:, 0], way[:, 0]) for f in (there, back))
    assert put_in > 1.0
    assert got_out == pytest.approx(returned * put_in, rel=1e-12)


def thrown(law, *, speed, returned):
    """A mass of 40 kg against one member: its velocity against the throw after a second, m/s."""
    body = Body(name="a", mass=40.0, inertia=1.0, velocity=(speed, 0.0, 0.0), gravity=False)
    member = Member(a="a", b="ground", point_b=(1.0, 0.0), law=replace(law, returned=returned))
    run = simulate(System(bodies=(body,), members=(member,)), [1.0], 1.0, 4000)
    return -float(run.velocity[-1, 0])


@pytest.mark.parametrize("speed", [0.8, 1.7, 2.6])
def test_a_vented_bag_throws_nobody_back(speed):
    bag = VentedAirbag(c0=300.0, speed=0.05)
    sealed = thrown(bag, speed=speed, returned=1.0)
    assert sealed == pytest.approx(speed, rel=2e-2)  # as fast as it came
    assert 0.0 <= thrown(bag, speed=speed, returned=0.0) <= 0.05  # no faster than the bag pushes at all


@pytest.mark.slow
def test_what_such_members_store_is_not_counted():
    """Neither in the energy nor in its rate and slopes, in the plane and in space."""
    laws = [replace(law, returned=0.5) for law in LAWS[:2]]
    body = Body(name="a", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    members = tuple(Member(a="a", b="ground", point_b=(-1.0, 0.1 * i), law=law) for i, law in enumerate(laws))
    free = SpatialBody(name="a", mass=1.0, inertia=(1.0,) * 3, joint=Floating(velocity=(0.5, 0.0, 0.0)))
    spatial = tuple(
        SpatialMember(a="a", b="ground", point_b=(-1.0, 0.1 * i, 0.0), law=law) for i, law in enumerate(laws)
    )
    for system in (System(bodies=(body,), members=members), TreeSystem(bodies=(free,), members=spatial)):
        run, stored = simulate(system, [1.0, 1.0], 0.3, 300), StoredEnergy()
        assert not run.stored_energy().any()
        assert not stored.rates(run, np.array([200, 290])).any()
        assert not gradient(system, [1.0, 1.0], run, Terminal(quantity=stored)).any()
        for slopes in (stored.slopes(run, 290), stored.rate_slopes(run, 290)):
            assert not any(np.any(slope) for slope in slopes if slope is not None)


def test_they_run_in_natural_coordinates_too():
    points = (
        NaturalPoint(name="a", position=(0.0, 0.0, 0.0), mass=2.0, velocity=(1.0, 0.0, 0.0)),
        NaturalPoint(name="b", position=(-1.0, 0.0, 0.0), fixed=True),
    )
    member = PointMember(a="a", b="b", law=Webbing(k=1e3, limit=1e6, returned=0.0, speed=0.02))
    run = simulate(NaturalSystem(points=points, members=(member,), gravity=(0.0, 0.0, 0.0)), [1.0], 0.5, 2000)
    # a mass on a spring until it turns, and hardly anything back
    reach = float(run.position[:, 0].max())
    assert reach == pytest.approx(np.sqrt(2.0 / 1e3), rel=5e-2)
    assert -0.021 < float(run.velocity[-1, 0]) <= 0.0


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (lambda: Webbing(k=0.0), "webbing needs k > 0 in N/m"),
        (lambda: Webbing(k=1.0, slack=-0.1), "webbing needs slack >= 0 and pull >= 0"),
        (lambda: Webbing(k=1.0, returned=1.2), "webbing needs 0 <= returned <= 1"),
        (lambda: LockingRetractor(k=1.0, locks=0.1, tension=-1.0), "needs tension >= 0 in N"),
        (lambda: LockingRetractor(k=1.0, locks=0.1, rise=0.0), "locking retractor needs rise > 0 in s"),
        (lambda: VentedAirbag(speed=0.0), "vented airbag needs speed > 0 in m/s"),
        (lambda: VentedAirbag(cap=0.2), "airbag needs 0 < cap < length"),
    ],
)
def test_numbers_that_cannot_be_are_refused(law, message):
    with pytest.raises(ValueError, match=message):
        law()

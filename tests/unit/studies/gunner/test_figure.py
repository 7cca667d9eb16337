"""The figure against Table 8.1, de Leva's segments and Table 8.6; its posture holds itself."""

import numpy as np
import pytest

from studies.gunner.cab import straight
from studies.gunner.cases import Case, numbers_of, system
from studies.gunner.figure import FIGURE, centre_of_mass, figure, pieces
from studies.gunner.figure_numbers import JOINTS, figure_numbers
from studies.gunner.holds import hands_on
from studies.gunner.parameters import FILE, InvalidNumber
from workbench.engine import simulate
from workbench.engine.tree.restart import restarted

HYBRID3 = FILE.with_name("data") / "hybrid3.toml"
REST = 1e-10  # m/s2: what rounding leaves of 9.81


@pytest.fixture(scope="module")
def numbers():
    return figure_numbers()


def test_mass_centre_and_height_are_those_of_table_8_1(numbers):  # G1
    assert numbers.figure.mass == pytest.approx(77.0, abs=1e-9)
    place = centre_of_mass(numbers) + numbers.posture.hip
    assert place == pytest.approx((-1.848, -0.041, 1.758), abs=0.010)
    assert place[2] - 0.77 == pytest.approx(0.988, abs=0.012)


def test_it_has_17_bodies_and_34_coordinates(numbers):
    bodies = system(Case(on=straight())).bodies
    assert tuple(b.name for b in bodies if b.mass > 0.0) == FIGURE
    assert len(FIGURE) == 17
    assert system(Case(on=straight())).size == 34
    assert len(figure(numbers).springs) == 34 - 6


def test_head_and_neck_together_are_what_they_were(numbers):
    neck, head = pieces(numbers)["neck"], pieces(numbers)["head"]
    whole = numbers.figure.head_and_neck
    places = np.array([neck.at + neck.centre, head.at + head.centre])
    mass = np.array([neck.mass, head.mass])
    centre = mass @ places / mass.sum()
    inertia = neck.inertia + head.inertia
    for m, place in zip(mass, places, strict=True):
        d = place - centre
        inertia = inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    assert mass.sum() == pytest.approx(whole.mass)
    assert centre[2] - neck.at[2] == pytest.approx((1.0 - whole.centre) * whole.length)
    assert inertia == pytest.approx(np.diag(whole.inertia), abs=1e-12)


def test_constant_torques_are_those_of_the_planar_reduction(numbers):
    """Both sides together, TX sense, N m; shoulders and hips carry what hangs on them."""
    springs = {(s.body, s.coordinate): s.torque for s in figure(numbers).springs}
    expected = {
        "lumbar": -20.76, "thoracic": -20.76, "cervical": 0.0, "upper arm": -20.76, "forearm": -6.20,
        "hand": -0.64, "thigh": -54.46, "shank": -1.51, "foot": -1.51,
    }  # fmt: skip
    for name, torque in expected.items():
        both = [
            springs[key] for key in ((name, 0), (f"left {name}", 0), (f"right {name}", 0)) if key in springs
        ]
        assert sum(both) == pytest.approx(torque, abs=0.02), name


def test_stiffness_and_stops_are_those_of_table_8_6(numbers):  # G2
    springs = {(s.body, s.coordinate): s for s in figure(numbers).springs}
    rows = {  # body, coordinate: N m/rad, back, forth
        ("upper arm", 0): (12.7389, 0.785, 1.083), ("upper arm", 1): (6.9999, 0.08, 1.745),
        ("forearm", 0): (30.0, 1.657, 0.523), ("hand", 0): (20.0, 1.378, 0.523),
        ("thigh", 0): (60.0, 0.488, 0.872), ("thigh", 1): (21.2314, 0.08, 0.471),
        ("shank", 0): (400.0, 0.872, 1.483), ("foot", 0): (300.0, 0.349, 0.872),
    }  # fmt: skip
    for (name, coordinate), row in rows.items():
        for side in ("left", "right"):
            found = springs[(f"{side} {name}", coordinate)]
            assert (found.k, found.lower, found.upper) == pytest.approx(row)
            assert found.c == 0.65192
    assert figure(numbers, joint_unit="N.m/rad").springs[-1].k == 300_000.0


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(
    ("turned", "coordinate", "seen", "axis", "sign"),
    [
        ("upper arm", 0, "forearm", 0, -1.0),  # stretches back
        ("upper arm", 1, "forearm", 1, 0.0),  # outwards
        ("forearm", 0, "hand", 2, -1.0),  # stretches: from flexed forwards to hanging
        ("hand", 0, None, 2, -1.0),
        ("thigh", 0, "shank", 0, -1.0),
        ("thigh", 1, "shank", 1, 0.0),
        ("shank", 0, "foot", 0, -1.0),  # the knee bends
        ("foot", 0, None, 2, -1.0),  # the toe goes down
    ],
)
def test_positive_turns_swing_hanging_segments_back_and_outwards(side, turned, coordinate, seen, axis, sign):
    still = system(Case(on=straight()))
    run = simulate(still, np.zeros(0), t_end=0.002, steps=2)
    q = run.position[0].copy()
    q[run.coordinate(f"{side} {turned}").start + coordinate] += 0.1
    moved = simulate(restarted(still, q), np.zeros(0), t_end=0.002, steps=2)
    body = f"{side} {seen or turned}"
    point = (0.0, 0.0, 0.0) if seen else pieces(figure_numbers())[body].centre
    change = moved.of(body, point)[0] - run.of(body, point)[0]
    outwards = 1.0 if side == "left" else -1.0
    assert change[axis] * (sign or outwards) > 0.005


@pytest.mark.parametrize("hands", ["none", "both"])
@pytest.mark.parametrize("unit", ["N.mm/rad", "N.m/rad"])
@pytest.mark.parametrize(
    "other", [{}, {"mass": 95.0}, {"figure": HYBRID3}], ids=["de Leva", "95 kg", "Hybrid III"]
)
def test_the_balanced_posture_is_an_exact_equilibrium_for_any_stiffness(hands, unit, other):
    rng = np.random.default_rng(3)
    factors = dict(zip(JOINTS, rng.uniform(0.5, 2.0, 8), strict=True))
    case = Case(on=straight(), hands=hands, joint_unit=unit, factors=factors, **other)
    run = simulate(system(case), np.zeros(0), t_end=0.002, steps=2)
    assert np.abs(run.acceleration).max() < REST


def test_the_torque_free_start_is_none():
    run = simulate(system(Case(on=straight(), start="torque-free")), np.zeros(0), t_end=0.002, steps=2)
    assert np.abs(run.acceleration).max() > 1.0


def test_hybrid_3_weighs_what_its_parts_do():
    # 172.3 lb
    assert numbers_of(Case(figure=HYBRID3)).figure.mass == pytest.approx(172.3 * 0.45359237, abs=0.01)


def test_slips_are_told(numbers, tmp_path):
    with pytest.raises(ValueError, match="start needs one of balanced, torque-free, settled, got 'sagging'"):
        figure(numbers, start="sagging")
    with pytest.raises(ValueError, match=r"factors needs joints among shoulder_tx, .*, got hip"):
        figure(numbers, factors={"hip": 2.0})
    with pytest.raises(ValueError, match=r"joint_unit needs one of N\.mm/rad, N\.m/rad, got 'lbf'"):
        figure(numbers, joint_unit="lbf")
    with pytest.raises(ValueError, match="the gunner needs a mass > 0 kg, got 0"):
        numbers_of(Case(mass=0.0))
    with pytest.raises(ValueError, match="hands needs one of none, one, both, got 'two'"):
        hands_on("two")
    own = tmp_path / "own.toml"
    own.write_text(FILE.read_text().replace("share = {", "part = {"))
    with pytest.raises(InvalidNumber, match=r"own.toml: \[gunner.figure.neck\] knows no 'part'"):
        figure_numbers(own)
    own.write_text(FILE.read_text().replace("value = 0.2247,", "value = 0.9,"))
    with pytest.raises(ValueError, match=r"the neck leaves the head no inertia: share 0\.9"):
        figure(figure_numbers(str(own)))


def test_bodies_that_all_cases_share_cannot_be_written_into():
    shared = pieces(figure_numbers())
    assert pieces(figure_numbers()) is shared
    with pytest.raises(ValueError, match="read-only"):
        shared["head"].centre[0] = 1.0
    with pytest.raises(TypeError, match="item assignment"):
        shared["head"] = shared["neck"]

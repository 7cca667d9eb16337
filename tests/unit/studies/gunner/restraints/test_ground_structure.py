"""Appendix C on the spatial gunner: points, laws, the layout model, and gradients by the densities."""

import numpy as np
import pytest

from studies.gunner.cases import Case, numbers_of
from studies.gunner.figure import pieces
from studies.gunner.occupant_responses import HATCH, RING_HEIGHT, objectives
from studies.gunner.parameters import FILE, InvalidNumber
from studies.gunner.restraints.ground_structure import FLOOR, KINDS, laws, restraints, sites
from studies.gunner.restraints.model import restraint
from workbench.engine import gradient, optimise_layout, simulate
from workbench.robust_layout.model import NEEDED


def test_columns_stand_on_an_octagon_about_the_hatch_in_five_layers():
    """Check R2 of the note: radius 400 mm within 0.3 mm, steps of 45 deg, layers 300 mm apart."""
    points = {site.vehicle_point: np.array(site.on_vehicle) for site in sites()}
    assert len(points) == 40
    heights = {site.layer: site.on_vehicle[2] for site in sites()}
    assert [heights[i] for i in range(1, 6)] == pytest.approx([1.959, 1.659, 1.359, 1.059, 0.759])
    assert heights[1] == pytest.approx(RING_HEIGHT)
    away = np.array([p[:2] - HATCH for p in points.values()])
    assert np.hypot(*away.T) == pytest.approx(0.4, abs=3e-4)
    # measured from the rear: each column is a multiple of 45 deg away
    steps = np.degrees(np.arctan2(*away.T)) / 45.0
    assert steps == pytest.approx(np.round(steps), abs=0.01)


def test_every_point_of_the_torso_has_fifteen_members_of_its_own_side():
    side = {"front": (0, 1.0), "back": (0, -1.0), "left": (1, 1.0), "right": (1, -1.0)}
    numbers = numbers_of(Case())
    hip, body = np.array(numbers.posture.hip), pieces(numbers)
    for point in range(1, 13):
        own = [site for site in sites() if site.gunner_point == point]
        assert len(own) == 15
        assert sum(site.layer == FLOOR for site in own) == 3
        axis, sign = side[own[0].side]
        # the gunner's end lies within his part of the torso, and the columns beyond that flank of his
        above = own[0].from_hip[2] - body[own[0].segment].at[2]
        assert 0.0 < above < 0.2472
        middle = np.mean([site.on_vehicle for site in own], axis=0) - hip - own[0].from_hip
        assert sign * middle[axis] > 0.05


def test_members_meet_the_gunner_in_his_posture():
    parts = restraints(numbers_of(Case()), KINDS)
    assert len(parts.members) == 540
    system = restraint(retractors=1.0).system({})
    ends = system.member_ends()
    lengths = np.linalg.norm(ends.point_a - ends.point_b, axis=1).reshape(3, 180)
    assert np.ptp(lengths, axis=0).max() < 1e-12
    # oracle of the note, section 12: planar with constant lateral offset, lengths 0.180 to 1.345, sum 120.927
    assert lengths[0].min() == pytest.approx(0.180, abs=5e-4)
    assert lengths[0].max() == pytest.approx(1.345, abs=5e-4)
    assert lengths[0].sum() == pytest.approx(120.927, abs=0.05)


def test_the_file_holds_the_laws(tmp_path):
    law = laws()
    assert (law["belt"].k1, law["belt"].k2, law["belt"].knee) == (4000.0, 1000.0, 0.015)
    assert (law["airbag"].c0, law["airbag"].length, law["airbag"].onset) == (30.0, 0.14, 0.005)
    assert (law["retractor"].f0, law["retractor"].sigma, law["retractor"].t0) == (500.0, 300.0, 1.5)
    changed = tmp_path / "mine.toml"
    changed.write_text(FILE.read_text().replace("value = 4000.0", "value = 5000.0"))
    assert laws(changed)["belt"].k1 == 5000.0
    wrong = tmp_path / "wrong.toml"  # a file is read once
    wrong.write_text(FILE.read_text().replace("value = 4000.0", "value = -1.0"))
    with pytest.raises(InvalidNumber, match=r"restraints\.belt\.first_rate must be more than 0 N/m, got -1"):
        laws(wrong)


def test_slips_are_named():
    with pytest.raises(ValueError, match="kinds needs names among belt, airbag, retractor, got rope"):
        restraints(numbers_of(Case()), ("rope",))
    with pytest.raises(ValueError, match="on needs one of braking, step steer, rollover, got 'kerb'"):
        restraint(on="kerb")
    with pytest.raises(ValueError, match="belts needs a budget >= 0, got -1"):
        restraint(belts=-1)
    with pytest.raises(ValueError, match="needs a budget > 0 of belts, airbags or retractors"):
        restraint(belts=0, airbags=0)
    with pytest.raises(ValueError, match=r"step needs 0 < step <= t_end = 1.5 s, got 2"):
        restraint(step=2.0)
    with pytest.raises(
        ValueError, match=r"step needs at most 0.0013 s, for the filter of the chest.*got 0.002"
    ):
        restraint(step=2e-3)
    with pytest.raises(ValueError, match=r"search_step needs 0 < search_step <= t_end = 1.5 s, got 0"):
        restraint(search_step=0.0)
    model = restraint()
    with pytest.raises(ValueError, match=r"density needs 360 values in \[0, 1\], got shape \(3,\)"):
        model.responses(np.zeros(3), {})
    with pytest.raises(ValueError, match=r"density needs 360 values in \[0, 1\], got 1.5"):
        model.responses(np.full(360, 1.5), {})
    with pytest.raises(ValueError, match="faces forward at level L0; got facing=90 and level='L0'"):
        model.system({"facing": 90.0})
    assert all(hasattr(model, name) for name in NEEDED)
    rows, columns, cells = model.places()
    assert (len(rows), len(columns), len(cells)) == (12, 40, 360)
    assert rows[0] == "1 upper front"


def test_layouts_are_made_of_longer_steps_than_they_are_judged_by():
    model = restraint(t_end=0.4, search_step=2e-3)
    assert (model.steps, restraint(t_end=0.4).searched) == (400, 0)
    longer, same = model.problem([{}]), restraint(t_end=0.4).problem([{}])
    density = np.full(model.members, 0.03)
    rows = [problem.evaluate(density).values for problem in (longer, same)]
    assert [values.shape[-1] for values in rows] == [201, 401]
    assert rows[0].max() == pytest.approx(rows[1].max(), rel=2e-3)
    assert model.responses(density, {})["g1"] == pytest.approx(rows[1].max(), rel=1e-6)


@pytest.mark.slow
def test_gradients_by_the_densities_are_those_of_differences():
    model = restraint(retractors=6.0, t_end=0.3)
    system, rng = model.system({"hands": "none"}), np.random.default_rng(3)
    density = 0.02 + 0.08 * rng.random(model.members)
    run = simulate(system, density, 0.3, model.steps)
    for name in ("smooth_g1", "smooth_rise"):
        objective = objectives(system, t_end=0.3)[name]
        along, h = rng.standard_normal(model.members), 1e-4
        beside = [objective.value(simulate(system, density + s * along, 0.3, model.steps)) for s in (-h, h)]
        assert gradient(system, density, run, objective) @ along == pytest.approx(
            (beside[1] - beside[0]) / (2.0 * h), rel=1e-6
        )


@pytest.mark.slow
def test_belts_are_laid_out_in_braking():
    """8.6.1.1 in four evaluations: g1 over 1 s falls by a third at least, and a true run agrees."""
    model = restraint(airbags=0.0, t_end=1.0)
    uniform = model.responses(np.full(180, 6.0 / 180.0), {})["g1"]
    found = optimise_layout(model.problem([{}]), method="gsao", max_evaluations=4)
    assert found.density.sum() <= 6.0 + 1e-9
    assert found.value < 0.67 * uniform
    assert model.responses(found.density, {})["g1"] == pytest.approx(found.value, rel=1e-6)

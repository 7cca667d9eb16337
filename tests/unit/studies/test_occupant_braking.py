"""The occupant's study: rows in, responses out, its layout model, its motion, and the demo's copy of it."""

import tomllib
from importlib.resources import files

import numpy as np
import pytest

from studies.occupant import member_sites
from studies.occupant_braking import (
    FACTORS,
    LEFT,
    NOMINAL,
    braking_occupant,
    case_of,
    responses_of,
    restraint,
)
from workbench.errors import StudyError
from workbench.robust_layout.model import NEEDED
from workbench.search.evidence.attack.strata import Strata
from workbench.search.runs.unit_space import SearchSpace
from workbench.study.loading import load_study
from workbench.study.shipped import STUDIES, copy_study


def test_responses_of_the_nominal_case_and_of_one_who_leaves():
    held = braking_occupant(**NOMINAL)
    assert held["peak_deviation"] < 0.15
    assert 0.005 < held["peak_rise"] < 0.05
    assert held["torso_acceleration"] > 7.0
    assert (held["grip_lost"], held["grip_lost_at"]) == (0.0, 2.0)
    thrown = braking_occupant(**{**NOMINAL, "hands": "one", "grip": 350.0, "deceleration": 9.0, "mass": 95.0})
    assert thrown["peak_deviation"] > LEFT
    assert thrown["grip_lost"] == 1.0
    assert 0.5 < thrown["grip_lost_at"] < 2.0


def test_factors_of_joints_that_turn_out_of_the_plane_change_nothing():
    moved = {**NOMINAL, "k_shoulder_tz": 0.5, "k_hip_tz": 2.0}
    assert braking_occupant(**moved) == braking_occupant(**NOMINAL)
    assert braking_occupant(**{**NOMINAL, "k_knee": 2.0}) != braking_occupant(**NOMINAL)
    assert len(FACTORS) == 8


def test_a_case_is_refused_by_name():
    with pytest.raises(ValueError, match=r"missing \['mass'\], unknown \['weight'\]"):
        case_of({**{k: v for k, v in NOMINAL.items() if k != "mass"}, "weight": 80.0})
    with pytest.raises(ValueError, match="hands needs one of none, one, both, got 'three'"):
        case_of({**NOMINAL, "hands": "three"})


def test_the_layout_model_has_what_the_loop_asks_for():
    for options, members, names in (
        ({}, 360, ("belt", "airbag")),
        ({"airbags": 0}, 180, ("belt",)),
        ({"budget": "shared"}, 360, ("all kinds",)),
        ({"retractors": 2.0}, 540, ("belt", "airbag", "retractor")),
        ({"belts": 0, "airbags": 0}, 180, ("belt",)),
    ):
        model = restraint(**options)
        problem = model.problem([NOMINAL])
        assert all(hasattr(model, name) for name in NEEDED)
        assert model.members == problem.members == members
        assert problem.names == names
        assert problem.excess(problem.into_budgets(problem.start.copy())) == pytest.approx(0.0, abs=1e-12)
    assert model.limits == {"belt": 0.0}


def test_the_problem_minimises_the_square_of_the_response():
    model = restraint()
    density = np.full(360, 0.02)
    value = float(model.problem([NOMINAL]).evaluate(density).values.max())
    # the problem refines its peaks between the nodes
    assert model.as_response(value) == pytest.approx(
        model.responses(density, NOMINAL)["peak_deviation"], rel=1e-4
    )


def test_runs_leave_out_members_that_do_nothing():
    model = restraint(steps=200)
    density = np.full(360, 1e-9)
    density[[3, 40, 200]] = 1.0, 0.5, 0.8
    found = model.responses(density, NOMINAL)
    for name, value in responses_of(model.run(density, NOMINAL)).items():
        assert found[name] == pytest.approx(value, rel=1e-6), name


def test_half_the_steps_are_nearly_enough():
    density = np.full(360, 0.02)
    coarse, fine = (
        restraint(steps=steps).responses(density, NOMINAL)["peak_deviation"] for steps in (500, 2000)
    )
    assert coarse == pytest.approx(fine, rel=1e-3)
    with pytest.raises(ValueError, match="steps needs at least 100 for two seconds, got 20"):
        restraint(steps=20)


@pytest.mark.slow
def test_what_four_milliseconds_cost_in_random_corners():
    """The figures of `restraint`: against 1 ms, in corners of the whole uncertainty, over random layouts."""
    space = load_study(str(files("studies") / "occupant_demo.toml")).space
    where, rng = SearchSpace.of(space), np.random.default_rng(8)
    corners = where.rows(Strata.of(where, rng=rng).corners(30, rng))
    errors = []
    for _ in range(2):
        density = np.zeros(360)
        density[rng.choice(360, 30, replace=False)] = rng.uniform(0.2, 0.6, 30)
        for corner in map(space.canonical, corners):
            found = [restraint(steps=n).responses(density, corner)["peak_deviation"] for n in (500, 2000)]
            errors.append(abs(found[0] / found[1] - 1))
    assert np.median(errors) < 1e-4
    assert np.quantile(errors, 0.95) < 5e-3


def test_the_motion_has_members_on_their_sites():
    model = restraint(airbags=0.0)
    density = np.zeros(180)
    density[[0, 100]] = 1.0, 0.5
    motion = model.motion({"bare": np.zeros(180), "held": density}, NOMINAL)
    bare, held = motion.runs
    assert (len(bare.members), len(held.members)) == (0, 2)
    for member, number in zip(held.members, (0, 100), strict=True):
        site = member_sites()[number]
        body = next(k for k, run in enumerate(held.bodies) if run.name == site.segment)
        assert member.body_a == body
    ends = held.segments(0)
    for k, number in enumerate((0, 100)):
        site = member_sites()[number]
        # the scene looks along the vehicle: its x is the model's -x, its z the model's y
        assert ends[k, 0, [0, 2]] == pytest.approx([-site.on_occupant[0], site.on_occupant[1]], abs=1e-6)
        assert ends[k, 1, [0, 2]] == pytest.approx([-site.on_vehicle[0], site.on_vehicle[1]], abs=1e-6)
        lengths = np.linalg.norm(ends[k, 0] - ends[k, 1])
        planar = np.hypot(*np.subtract(site.on_occupant, site.on_vehicle))
        assert lengths == pytest.approx(np.hypot(planar, site.offset), rel=1e-6)


def test_the_layout_matrix_has_a_cell_for_every_member():
    rows, columns, cells = restraint().places()
    assert (len(rows), len(columns), len(cells)) == (12, 40, 360)
    assert len(set(cells[:180])) == 180
    assert cells[:180] == cells[180:]
    assert rows[0] == "1 upper front"
    assert columns[-1].endswith("layer 5")


def test_the_demo_is_the_study_in_a_small_setting():
    full, small = (
        tomllib.loads((files("studies") / name).read_text())
        for name in ("occupant_braking.toml", "occupant_demo.toml")
    )
    for table in ("model", "parameter", "response", "screen", "design"):
        assert full[table] == small[table]
    for key in ("model", "options", "nominal", "start", "tolerance"):
        assert full["robust_layout"][key] == small["robust_layout"][key]
    for key in ("evaluations", "budget", "rounds", "samples"):
        assert full["robust_layout"][key] > small["robust_layout"][key]
    assert [v["name"] for v in full["robust_layout"]["variant"]] == [
        "belts alone", "belts and airbags, one budget",
    ]  # fmt: skip
    assert "variant" not in small["robust_layout"]  # each costs an optimisation more
    assert dict(small["robust_layout"]["nominal"]) == NOMINAL


def test_all_demonstrations_are_copied_and_load(tmp_path):
    for name in STUDIES:
        study = load_study(copy_study(tmp_path, name))
        assert study.worst_case is not None
    with pytest.raises(StudyError, match="no demonstration 'lorry'; there are occupant, welch20, gunner"):
        copy_study(tmp_path, "lorry")


def test_runs_at_a_longer_step_are_solved_as_closely_as_a_hint_needs():
    model = restraint()
    density = np.zeros(model.members)
    density[:: model.members // 24] = 0.5
    cases = [NOMINAL, {**NOMINAL, "hands": "none", "seat_cap": 300.0}]
    rough = model.coarsened(density, cases, threads=1)
    close = [restraint(steps=250).responses(density, case) for case in cases]
    for found, wanted in zip(rough, close, strict=True):
        assert found["peak_deviation"] == pytest.approx(wanted["peak_deviation"], rel=1e-7)
        assert found != wanted

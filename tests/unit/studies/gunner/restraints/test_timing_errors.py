"""Retractors that fire late or early, and the study of the rollover in which that is uncertain."""

from importlib.resources import files

import pytest

from studies.gunner.cases import Case, numbers_of
from studies.gunner.restraints.ground_structure import KINDS, laws, restraints
from studies.gunner.restraints.model import restraint
from workbench.robust_layout.model import load_layout_model
from workbench.study.loading import load_study


def test_retractors_alone_fire_late():
    numbers = numbers_of(Case())
    on_time, late = (restraints(numbers, KINDS, late=by) for by in (0.0, 0.04))
    for before, after in zip(on_time.members, late.members, strict=True):
        if before.name.startswith("retractor"):
            assert after.law.t0 == pytest.approx(before.law.t0 + 0.04)
        else:
            assert after.law == before.law
    assert laws()["retractor"].t0 == 1.5  # those of the file stay as they are


def test_a_row_says_how_late():
    model = restraint(on="rollover", retractors=1.0)
    held = model.system({"fires_late": -0.05}).members[360:]
    assert [member.law.t0 for member in held] == pytest.approx([1.45] * 180)


def test_the_study_of_the_rollover_is_whole():
    study = load_study(str(files("studies.gunner.restraints") / "restraint_rollover.toml"))
    table = study.robust_layout
    model = load_layout_model(table["model"], table["options"], folder=study.folder)
    assert (model.on, model.kinds, model.t_end) == ("rollover", KINDS, 3.0)
    names = [p.name for p in study.space.parameters]
    assert set(table["nominal"]) == set(names) >= {"fires_late", "friction", "hands"}
    assert study.space.canonical(table["nominal"]) == table["nominal"]

"""Dotted names of the time before the rooms go on working, and say where things are now."""

import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import workbench
from workbench._moved import MOVED, found, places

ROOT = Path(workbench.__file__).parent
ROOMS = [old for old in MOVED if (ROOT / old.replace(".", "/")).is_dir()]

# what the pages, the gallery and the first studies told users to import
DOCUMENTED = {
    "campaign": ("Campaign",),
    "demonstration": ("copy_study",),
    "design": ("Design", "DesignOptions", "compare", "make_design"),
    "design_files": ("read_design", "write_design"),
    "design_plots": ("plot_design",),
    "enclosure": ("Enclosure",),
    "engine.layout.problem": ("InvalidLayout", "LayoutProblem", "MemberGeometry", "static_problem"),
    "engine.layout.purify": ("purify",),
    "engine.layout.transient": ("Scenario", "transient_problem"),
    "engine.multibody.schemes": ("GeneralisedAlpha", "VelocityVerlet"),
    "layout": ("load_problem", "run_layout"),
    "layout_model": ("LayoutModel",),
    "layout_plots": ("plot_density", "plot_front", "plot_layout"),
    "minimax": ("minimax",),
    "model": ("History", "open_model"),
    "motion": ("Body", "History", "Member", "Motion", "MotionRun", "planar_poses"),
    "parameter": ("Parameter",),
    "plots": ("plot_waterfall",),
    "readings": ("weighted", "within"),
    "report": ("report_numbers", "write_report"),
    "report_sections.blocks": ("Section",),
    "robust_layout": ("RobustLayout",),
    "screening": ("Screening", "screen"),
    "space": ("Distribution", "Parameter", "Response", "Space"),
    "stills": ("camera_of", "png", "still"),
    "store_schema": ("SCHEMA",),
    "streams": ("stream",),
    "study": ("Study", "load_study"),
    "summaries": ("format_number", "worst_case_lines"),
    "trajectories": ("dataset", "frames", "plot_histories", "plot_storyboard"),
    "worst_case": ("WorstCase", "worst_case"),
    "worst_cases": ("worst_cases",),
    "worst_quantile": ("worst_quantile",),
}


@pytest.mark.parametrize("old", MOVED)
def test_every_new_place_is_there(old):
    assert [place for place in places(f"workbench.{old}") if find_spec(place) is None] == []


@pytest.mark.parametrize("old", DOCUMENTED)
def test_documented_names_go_on_working(old):
    name = f"workbench.{old}"
    for wanted in DOCUMENTED[old]:
        place, value = found(name, wanted)
        if old not in ROOMS:
            sys.modules.pop(name, None)
        namespace: dict = {}
        with pytest.warns(DeprecationWarning, match=rf"^{name}\S* moved to .*{place}"):
            exec(f"from {name} import {wanted}", namespace)
        assert namespace[wanted] is value


def test_the_warning_names_the_line_of_the_user():
    sys.modules.pop("workbench.design", None)
    with pytest.warns(DeprecationWarning, match="workbench.sampling.plan") as caught:
        import workbench.design  # noqa: F401
    assert caught[0].filename == __file__


def test_an_old_package_warns_of_what_is_taken_from_it():
    package = import_module("workbench.engine.multibody")
    with pytest.warns(DeprecationWarning, match="multibody.System moved to workbench.engine.System"):
        assert package.System is import_module("workbench.engine").System


def test_a_room_warns_at_the_line_of_the_user():
    import workbench.space

    with pytest.warns(DeprecationWarning, match="workbench.space.Space moved to") as caught:
        _ = workbench.space.Space
    assert caught[0].filename == __file__


def test_public_functions_are_not_hidden_by_old_modules_of_their_name():
    sys.modules.pop("workbench.minimax", None)
    with pytest.warns(DeprecationWarning, match="workbench.minimax moved to workbench.robust.minimax"):
        import_module("workbench.minimax")
    assert callable(workbench.minimax)


def test_rooms_that_bear_an_old_name_hand_out_their_files_without_a_word():
    from workbench.space import box
    from workbench.stages import layout

    assert (box.__name__, layout.__name__) == ("workbench.space.box", "workbench.stages.layout")
    assert {"campaign", "motion", "report", "screening", "space", "stages", "study"} <= set(ROOMS)


@pytest.mark.filterwarnings("ignore:workbench.design moved:DeprecationWarning")  # where it is the first use
@pytest.mark.parametrize("name", ["workbench.nothing", "workbench.space.nothing", "workbench.design.nothing"])
def test_what_never_was_is_not_found(name):
    with pytest.raises(ModuleNotFoundError, match=f"No module named '{name}'"):
        import_module(name)


@pytest.mark.filterwarnings("ignore:workbench.design moved:DeprecationWarning")
def test_names_that_never_were():
    import workbench.space

    with pytest.raises(AttributeError, match=r"module 'workbench\.space' has no attribute 'nothing'"):
        _ = workbench.space.nothing
    with pytest.raises(AttributeError, match=r"module 'workbench\.space' has no attribute '_hidden'"):
        _ = workbench.space._hidden
    with pytest.raises(AttributeError, match=r"module 'workbench\.design' has no attribute '__wrapped__'"):
        _ = import_module("workbench.design").__wrapped__


def test_importing_the_workbench_does_not_load_the_table():
    code = "import sys, workbench.space.streams; assert 'workbench._moved' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)

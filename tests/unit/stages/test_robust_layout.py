"""What a check says of a `[robust_layout]` table before anything runs, and what the stage rests on."""

from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from tests.sample_layout import STUDY, changed, run, study
from workbench.errors import StudyError
from workbench.report.sections.findings import after_text
from workbench.robust_layout.model import load_layout_model, load_problem
from workbench.stages.campaign import Campaign
from workbench.stages.robust_layout import _broken, _model_identity, _screened, _worst_cases
from workbench.stages.up_to_date import settled
from workbench.stages.validation import check_study
from workbench.terminal.cli import app

MODEL_LINE = STUDY.splitlines().index('model = "tests.sample_layout:two_members"') + 1


def test_another_unit_than_the_layout_models_is_refused_with_both(tmp_path):
    said = (
        rf"two.toml, line {MODEL_LINE}: the layout model 'tests.sample_layout:two_members' gives push in "
        "'N', the study's response push is in 'kN'. Give both in one unit"
    )
    with pytest.raises(StudyError, match=said):
        check_study(study(tmp_path, changed('unit = "N"', 'unit = "kN"')))


def test_a_unit_may_be_spelt_in_two_ways(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.sample_layout.TwoMembers.unit", "m/s^2")
    check_study(study(tmp_path, changed('unit = "N"', 'unit = "m/s2"')))
    monkeypatch.setattr("tests.sample_layout.TwoMembers.unit", "")
    check_study(study(tmp_path, changed('unit = "N"', 'unit = "1"')))


def test_a_response_that_the_layout_model_alone_has_is_said_to_be_its(tmp_path):
    said = (
        rf"two.toml, line {MODEL_LINE}: the layout model 'tests.sample_layout:two_members' is for the "
        "response 'push', which the study does not have; its responses are pull"
    )
    with pytest.raises(StudyError, match=said):
        check_study(study(tmp_path, STUDY.replace('"push"', '"pull"')))


def test_a_variant_is_refused_on_its_own_line(tmp_path):
    wrong = STUDY + '\n[[robust_layout.variant]]\nname = "odd"\noptions = { colour = "red" }\n'
    line = len(wrong.splitlines())
    with pytest.raises(StudyError, match=rf"two.toml, line {line}: .*keyword argument 'colour'"):
        check_study(study(tmp_path, wrong))


BROKEN = """
KINDS = {"box": "a box"}
class Model:
    response, unit, members = "push", "N", 2
    problem = as_response = responses = None
    def __init__(self, kind):
        self.kind = kind
    @property
    def title(self):
        return KINDS[self.kind]
def model(kind):
    return Model(kind)
def hasty(kind):
    return KINDS[kind]
def vague(kind):
    made = Model(kind)
    made.kind = made.sort
    return made
"""


def test_an_error_of_the_users_code_is_told_with_their_line(tmp_path):
    (tmp_path / "broken_layouts.py").write_text(BROKEN)
    with pytest.raises(
        StudyError,
        match=r"layout model 'broken_layouts:model' with \{'kind': 'boxx'\} does not give its title: "
        r"KeyError: 'boxx' \(broken_layouts.py, line 10, in title\)",
    ):
        load_layout_model("broken_layouts:model", {"kind": "boxx"}, folder=tmp_path)
    with pytest.raises(StudyError, match=r"KeyError: 'boxx' \(broken_layouts.py, line 14, in hasty\)"):
        load_problem("broken_layouts:hasty", {"kind": "boxx"}, folder=tmp_path)
    with pytest.raises(StudyError, match=r"no attribute 'sort' \(broken_layouts.py, line 17, in vague\)"):
        load_problem("broken_layouts:vague", {"kind": "box"}, folder=tmp_path)
    (tmp_path / "no_python.py").write_text("def f(:\n")
    with pytest.raises(StudyError, match="'no_python:f': importing no_python failed: SyntaxError"):
        load_problem("no_python:f", folder=tmp_path)


SIDED = """
from dataclasses import replace
from tests.sample_layout import TwoMembers
from workbench.engine.layout.formulation.problem import InvalidLayout
SIDES = {"left": -1.0, "right": 1.0, 0: 0.0, 1: 0.5}
class Sided(TwoMembers):
    def problem(self, cases):
        if any(case["side"] == "aloft" for case in cases):
            raise InvalidLayout("no run there")
        made = super().problem([{"u": SIDES[case["side"]], "v": SIDES[case["v"]]} for case in cases])
        return replace(made, costs=made.costs * self.counted)
def bare(side, v):
    return {"push": 0.0}
def model(members=2, budget=1.0, counted=1.0):
    made = Sided(budget)
    made.members, made.counted = members, counted
    return made
"""


def sided(words, options=""):
    u = f'[[parameter]]\nname = "side"\nkind = "categorical"\nlevels = {words}'
    text = changed('[[parameter]]\nname = "u"\nlower = -1\nupper = 1', u)
    text = changed('name = "v"\nlower = 0\nupper = 1', 'name = "v"\nkind = "binary"', text)
    text = changed('"tests.sample_layout:bare"', '"sided_layouts.py:bare"', text)
    text = changed('"tests.sample_layout:two_members"', f'"sided_layouts:model"\n{options}', text)
    return changed("u = 0.9, v = 0.5", 'side = "left", v = 0', text)


def test_a_word_that_the_layout_model_does_not_know_is_refused_before_a_run(tmp_path):
    (tmp_path / "sided_layouts.py").write_text(SIDED)
    check_study(study(tmp_path, sided('["left", "right", "aloft"]')))  # what cannot be run is an answer
    with pytest.raises(
        StudyError,
        match=rf"two.toml, line {MODEL_LINE - 1}: the layout model 'two members' makes no problem of the "
        r"case \{'side': 'rihgt', 'v': 0\}: KeyError: 'rihgt' \(sided_layouts.py, line 10",
    ):
        check_study(study(tmp_path, sided('["left", "rihgt"]')))


def test_a_layout_model_without_a_problem_for_the_nominal_case_is_refused(tmp_path):
    (tmp_path / "sided_layouts.py").write_text(SIDED)
    words = '["left", "right"]'
    with pytest.raises(StudyError, match="no problem for the nominal case: 'all' allows -1 but the lower"):
        check_study(study(tmp_path, sided(words, "options = { budget = -1 }")))
    with pytest.raises(StudyError, match="says that it has 3 members, its problem has 2"):
        check_study(study(tmp_path, sided(words, "options = { members = 3 }")))
    with pytest.raises(
        StudyError, match="the budget 'all' of 'layout' counts no member: all of its costs are"
    ):
        check_study(study(tmp_path, sided(words, "options = { counted = 0 }")))


@pytest.mark.parametrize("table", ["robust_layout", "worst_case"])
def test_a_tolerance_is_a_share(tmp_path, table):
    text = changed(f"[{table}]", f"[{table}]\ntolerance = 2")
    said = rf"{table}.tolerance needs a share below 1, such as 0.02 for 2 %, got 2"
    with pytest.raises(StudyError, match=said):
        study(tmp_path, text)


def test_an_attack_too_short_to_close_a_loop_is_worth_a_word(tmp_path):
    said = (
        "[robust_layout] budget = 45 is too short an attack to call the loop closed: that takes 1246 true "
        "runs, which leave less than 1 % of the uncertainty beyond"
    )
    assert check_study(study(tmp_path, changed("budget = 1300", "budget = 45")))["notes"] == [said]
    shown = CliRunner().invoke(app, ["validate", str(tmp_path / "two.toml")]).output.splitlines()
    assert " ".join(line.strip() for line in shown[1:]) == f"note: {said}"
    assert max(map(len, shown[1:])) <= 80
    assert check_study(study(tmp_path))["notes"] == []
    few = 'kind = "discrete"\nlevels = [0, 0.9]'
    both = changed("lower = -1\nupper = 1", few, changed("lower = 0\nupper = 1", few))
    both = both.replace("v = 0.5", "v = 0.9").replace("budget = 1300", "budget = 45")
    assert check_study(study(tmp_path, both))["notes"] == []  # all four cases are run


def test_a_screening_of_another_response_is_not_held_beside_the_layouts(tmp_path):
    (tmp_path / "design.json").write_text('{"physical": [[0.1]]}')
    (tmp_path / "screening.json").write_text('{"response": "travel", "selected": ["mass"]}')
    campaign = SimpleNamespace(folder=tmp_path, study=SimpleNamespace(screen={"method": "auto"}))
    found = _screened(campaign, SimpleNamespace(response="push"), None, None)
    assert found == {
        "before": ["mass"], "after": None, "reason": "it is of travel, and the layout is for push",
    }  # fmt: skip
    (said,) = after_text({"screening": found})
    assert said.endswith("the screening told nothing: it is of travel, and the layout is for push.")


def test_a_worst_case_outside_of_the_bounds_that_there_are_is_told_as_that(tmp_path):
    (tmp_path / "worst_case.json").write_text('{"parameters": {"u": 1.0, "v": 0.5}}')
    there, narrowed = (study(tmp_path, text) for text in (STUDY, changed("upper = 1\n", "upper = 0.95\n")))
    table = {"start": "worst_case"}
    campaign = SimpleNamespace(folder=tmp_path, study=there)
    assert _worst_cases(campaign, table) == [{"u": 1.0, "v": 0.5}]
    campaign.study = narrowed
    said = r"starts with was found in another space: .*'u' .*got 1\. `holdfast run` looks for it anew"
    with pytest.raises(StudyError, match=said):
        _worst_cases(campaign, table)


def test_a_loop_whose_layout_model_changed_is_not_up_to_date(tmp_path):
    """It is no part of the study's model, whose state the store knows."""
    model = tmp_path / "layout_beside.py"
    model.write_text("from tests.sample_layout import two_members\n")
    text = changed("tests.sample_layout:two_members", "layout_beside:two_members")
    for old, new in (("budget = 1300", "budget = 60"), ("rounds = 5", "rounds = 1")):
        text = changed(old, new, text)
    run(tmp_path, text)
    with Campaign(study(tmp_path, text)) as campaign:
        assert settled(campaign) is not None
    model.write_text("from tests.sample_layout import two_members\n\nSHARE = 0.3\n")
    with Campaign(study(tmp_path, text)) as campaign:
        assert settled(campaign) is None


def test_code_and_data_that_a_layout_model_takes_from_elsewhere_are_part_of_it(tmp_path):
    campaign = SimpleNamespace(study=SimpleNamespace(folder=tmp_path), spec=SimpleNamespace(version="1"))
    files = {"lay.py": "import shares\n", "shares.py": "FILE = 'share.csv'\n", "share.csv": "0.3\n"}
    for name, text in files.items():
        (tmp_path / name).write_text(text)

    def identity(model="lay:made"):
        return _model_identity(campaign, {"model": model, "options": {}})

    before = {identity()}
    (tmp_path / "shares.py").write_text("FILE = 'share.csv'  # a comment\n")
    assert identity() in before
    for name, text in {"shares.py": "FILE, MORE = 'share.csv', 1\n", "share.csv": "0.1\n"}.items():
        (tmp_path / name).write_text(text)
        assert identity() not in before
        before.add(identity())
    assert identity("scipy.optimize:linprog") != identity("scipy.stats:norm")  # installed


def test_a_sample_that_breaks_the_bound_counts_where_another_layout_failed():
    summary = SimpleNamespace(worst=1.0, worst_run=1.5, worst_run_scenario={"u": 1.0})
    found = SimpleNamespace(worst={"robust": SimpleNamespace(value=1.2)}, robust="robust")
    compared = SimpleNamespace(summaries=[summary])
    assert _broken(compared, found, 0.02) == {"u": 1.0}
    assert _broken(compared, found, 0.3) is None


@pytest.mark.parametrize(("sampled", "breaks"), [(-0.5, False), (-0.495, False), (-0.48, True), (0.1, True)])
def test_a_response_below_zero_is_broken_by_what_lies_above_it(sampled, breaks):
    """As minus a clearance: a worst case of -0.5 m was broken by itself, -0.5 > 1.02 (-0.5)."""
    summary = SimpleNamespace(worst_run=sampled, worst_run_scenario={"u": 1.0})
    found = SimpleNamespace(worst={"robust": SimpleNamespace(value=-0.5)}, robust="robust")
    broken = _broken(SimpleNamespace(summaries=[summary]), found, 0.02)
    assert (broken is not None) == breaks

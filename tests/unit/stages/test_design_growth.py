"""A design that changed under its runs: the stored ones serve on, only what is missing is new."""

import json

import numpy as np
import pytest

from workbench.campaign.permissions import Permissions
from workbench.errors import StudyError
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.planning import plan_lines, plan_study
from workbench.stages.run_all import run_stage
from workbench.study.loading import load_study

PARAMETER = '[[parameter]]\nname = "{name}"\nlower = {lower}\nupper = {upper}\n{more}\n'


class Study:
    """A study file that is rewritten, whose model counts its runs."""

    def __init__(self, folder):
        self.folder, self.calls = folder, folder / "calls"
        self.calls.write_text("")

    def write(self, *, runs=20, seed=3, kind="optimised_lhs", a=(0, 10), more=(), options=""):
        names = ["a", "b", *(m[0] for m in more)]
        parameters = [("a", *a, ""), ("b", 0, 1, ""), *more]
        (self.folder / "m.py").write_text(
            f"def f(a, b, tilt=0.0):\n    with open({str(self.calls)!r}, 'a') as file:\n"
            "        file.write('x')\n    return a + b + tilt\n"
        )
        text = f'[study]\nname = "s"\nseed = {seed}\n[model]\nkind = "python"\nfunction = "m.py:f"\n'
        for name, lower, upper, rest in parameters:
            text += PARAMETER.format(name=name, lower=lower, upper=upper, more=rest)
        text += f'[[response]]\nname = "y"\n[evaluate]\nengine = "inline"\n[design]\nkind = "{kind}"\n'
        (self.folder / "s.toml").write_text(f"{text}runs = {runs}\n{options}")
        return names

    def run(self, *, permissions=None, **changes):
        """Design and runs; the design's document and how many runs were made."""
        self.write(**changes)
        before = len(self.calls.read_text())
        with Campaign.from_file(self.folder / "s.toml", permissions=permissions) as campaign:
            document = run_stage(campaign, "design")
            assert set(evaluate(campaign)["counts"]) == {"ok"}
        return document, len(self.calls.read_text()) - before


@pytest.fixture
def study(tmp_path):
    return Study(tmp_path)


def test_more_runs_are_made_beside_those_that_are_there(study):
    first, made = study.run()
    assert made == 20
    more, made = study.run(runs=30)
    assert made == 10
    assert (more["n"], more["physical"][:20], more["run_ids"][:20]) == (
        30,
        first["physical"],
        first["run_ids"],
    )
    assert more["run_ids"][-1] == "r0030"
    fewer, made = study.run(runs=10)
    assert (fewer["n"], made) == (30, 0), "nothing that was paid for is left out"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ihs", "sobol", "d_optimal_select", "lhs"])
def test_another_kind_keeps_the_runs(study, kind):
    first, _ = study.run()
    other, made = study.run(kind=kind, runs=25)
    assert made == 5
    assert other["physical"][:20] == first["physical"]
    assert other["algorithm"] == kind


def test_narrower_bounds_keep_what_lies_inside(study):
    first, _ = study.run()
    inside = [point for point in first["physical"] if point[0] <= 5]
    found, made = study.run(a=(0, 5))
    assert found["physical"][: len(inside)] == inside
    assert made == found["n"] - len(inside) == 20 - len(inside)


@pytest.mark.slow
def test_wider_bounds_are_filled_where_no_run_lies(study):
    first, _ = study.run()
    found, made = study.run(a=(0, 15))
    assert found["physical"][:20] == first["physical"]
    new = np.array(found["physical"][20:])
    assert made == len(new) == 6  # the strata of 20 that lie beyond 10
    assert new[:, 0].max() > 13
    assert (new[:, 0] > 10).all()


@pytest.mark.slow
def test_a_new_parameter_keeps_the_runs_at_its_baseline(study):
    first, _ = study.run()
    tilt = [("tilt", -1, 1, "baseline = 0.25")]
    with pytest.raises(
        StudyError, match=r"20 stored runs do not serve: 'tilt' is new; --at-baseline takes .* Say so, or"
    ):
        study.run(more=tilt)
    found, made = study.run(more=tilt, permissions=Permissions(at_baseline=True))
    assert [point[:2] for point in found["physical"][:20]] == first["physical"]
    assert {point[2] for point in found["physical"][:20]} == {0.25}
    assert made == found["n"] - 20 == 19, "the new parameter varies over its range"
    assert study.run(more=tilt)[1] == 0
    with pytest.raises(StudyError, match="39 stored runs do not serve: the new parameter 'roll' has no base"):
        study.run(more=[*tilt, ("roll", 0, 1, "")])


def test_another_seed_is_refused_with_the_cure(study):
    study.run()
    with pytest.raises(
        StudyError,
        match=r"seed = 4, but 20 stored runs of a design with seed 3 would be lost. Set seed = 3 again",
    ):
        study.run(seed=4)


def test_a_factorial_is_what_it_is_and_finds_its_runs(study):
    study.run(kind="factorial", runs=9, options="levels = 3")
    found, made = study.run(kind="factorial", runs=25, options="levels = 5")
    assert (found["n"], made) == (25, 16)


def test_a_design_without_answers_is_drawn_afresh(study):
    study.write()
    with Campaign.from_file(study.folder / "s.toml") as campaign:
        first = run_stage(campaign, "design")
    study.write(seed=4)
    with Campaign.from_file(study.folder / "s.toml") as campaign:
        assert run_stage(campaign, "design")["physical"] != first["physical"]


@pytest.mark.slow
def test_a_grown_design_of_the_default_kind_is_as_good_as_a_fresh_one():
    from workbench.sampling.plan import make_design
    from workbench.space.box import Parameter, Space

    space = Space([Parameter(f"x{k}", lower=0, upper=1) for k in range(8)])
    figures = ("phi_p", "cd2", "max_correlation")
    ratios = []
    for seed in (21, 22, 23):
        fresh = make_design(space, "ihs", 60, seed=seed).quality(references=2)
        grown = make_design(space, "ihs", 40, seed=seed).grown(20, seed=seed).quality(references=2)
        ratios.append([grown.to_dict()[f]["value"] / fresh.to_dict()[f]["value"] for f in figures])
    assert np.max(ratios) < 1.05, json.dumps(ratios)


@pytest.mark.slow
def test_a_part_of_a_larger_design_is_run_first_and_the_rest_when_it_is_asked_for(study):
    from workbench.report.lines.design import design_lines
    from workbench.sampling.plan import make_design

    first, made = study.run(runs=12, options="up_to = 20")
    assert (first["n"], len(first["later"]), made) == (12, 8, 12)
    assert "these are 12 of 20 runs drawn at once; runs = 20 makes the other 8" in design_lines(first)
    space = load_study(study.folder / "s.toml").space
    whole = sorted(make_design(space, "optimised_lhs", 20, seed=3).unit.tolist())
    assert sorted([*first["unit"], *first["later"]]) == whole
    more, made = study.run(runs=16, options="up_to = 20")
    assert (more["n"], len(more["later"]), made) == (16, 4, 4)
    assert more["physical"][:12] == first["physical"]
    same, made = study.run(runs=16)
    assert (len(same["later"]), made) == (4, 0), "they were drawn: the key may be taken out"
    done, made = study.run(runs=20)
    assert (made, sorted(done["unit"])) == (4, whole)
    assert "later" not in done
    assert not any("drawn at once" in line for line in design_lines(done))
    beyond, made = study.run(runs=24)
    assert (beyond["n"], made) == (24, 4)
    said = " ".join(line.strip() for line in design_lines(beyond))
    assert "beside 24 runs drawn at once the grown design has" in said
    again, made = study.run(runs=24, options='criterion = "phi_p"')
    assert (again["beside_fresh"], made) == (beyond["beside_fresh"], 0)
    with pytest.raises(StudyError, match="up_to needs runs or more, at most 2000; got 20, runs = 24"):
        study.run(runs=24, options="up_to = 20")


def test_the_plan_says_what_serves_before_anything_runs(study):
    study.run()
    study.write(runs=32, a=(0, 5))
    plan = plan_study(load_study(study.folder / "s.toml"))
    inside = plan["design"]["serve"]
    assert plan["design"]["left_out"] == {"they lie outside the bounds": 20 - inside}
    assert plan["design"]["new"] == 32 - inside
    lines = plan_lines(plan)
    assert any(line.startswith(f"{inside} runs of the design that is there serve on") for line in lines)
    assert "`holdfast design` places them, and says what growing costs; it runs nothing" in lines
    study.run(runs=32, a=(0, 5))
    lines = plan_lines(plan_study(load_study(study.folder / "s.toml")))
    assert not any("`holdfast design` places them" in line for line in lines)
    assert "beside 32 runs drawn at once the grown design has" in " ".join(lines)
    study.write(seed=9)
    lines = plan_lines(plan_study(load_study(study.folder / "s.toml")))
    assert any("Set seed = 3 again" in line for line in lines)


def test_the_plan_says_that_the_model_changed_before_a_run_is_refused(study):
    study.run()
    path = study.folder / "s.toml"
    assert "changed" not in plan_study(load_study(path))
    source = study.folder / "m.py"
    source.write_text(source.read_text().replace("a + b", "a - b"))
    plan = plan_study(load_study(path))
    assert (plan["changed"]["runs"], plan["changed"]["changes"]) == (20, "code m.py changed")
    said = " ".join(line.strip() for line in plan_lines(plan))
    assert (
        "`run` refuses: the source of the model changed after 20 runs were stored in s.holdfast: code m.py "
        "changed. Undo that; or give --same-model when their results still hold, or --new-version to make "
        "them anew beside the old ones"
    ) in said
    with pytest.raises(
        StudyError, match=r"changed after 20 runs .*: code m\.py changed\. Undo that; or give"
    ):
        Campaign.from_file(path)
    Campaign.from_file(path, permissions=Permissions(same_model=True)).close()
    assert "changed" not in plan_study(load_study(path))


def test_the_plan_says_what_is_read_again(study):
    study.run()
    study.write()
    path = study.folder / "s.toml"
    path.write_text(path.read_text().replace('name = "y"', 'name = "other"'))
    plan = plan_study(load_study(path))
    assert plan["reading"] == {"read_again": 20, "cannot_be_read": 0, "response": "", "reason": ""}
    assert "the responses of 20 stored runs are read again; nothing is run" in plan_lines(plan)
    path.write_text(path.read_text().replace("[[response]]", '[[response]]\nname = "more"\n[[response]]'))
    lines = plan_lines(plan_study(load_study(path)))
    assert (
        "response 'more' cannot be read from 20 stored runs: the model did not return it; --run-again makes "
        "them anew"
    ) in lines

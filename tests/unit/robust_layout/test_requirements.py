"""What is required of a layout: held against its true runs, told first, refused where it asks for nothing."""

import json
from types import SimpleNamespace

import pytest

from tests.sample_layout import ROBUST, STUDY
from workbench.errors import StudyError
from workbench.models.evaluator import Outcome
from workbench.report.lines.requirements import requirement_text
from workbench.report.writing import write_report
from workbench.robust_layout.loop_documents import requirement_documents
from workbench.stages.campaign import Campaign
from workbench.study.loading import parse_study

TRIED = SimpleNamespace(value=0.28, attack={"runs": 480})
ATTACKED = SimpleNamespace(grade="attacked", closed=True, robust="r", worst={"r": TRIED})
OPEN = SimpleNamespace(grade="searched", closed=False, may_exceed=0.12, robust="r", worst={"r": TRIED})


def runs(*values):
    return [
        Outcome(parameters={"u": k}, status="failed" if v is None else "ok", outputs={} if v is None else v)
        for k, v in enumerate(values)
    ]


def judged(required, found, sampled, response="rise", loop=ATTACKED):
    outcomes = {"found": runs(*found), "sampled": runs(*sampled)}
    units = {"rise": "m", "chest": "1"}
    return requirement_documents(required, loop, outcomes, response=response, units=units)


def test_both_sides_are_held_and_the_first_case_beyond_is_named():
    few = [{"rise": 0.1, "chest": 40.0}, {"rise": 0.3, "chest": 70.0}]
    many = [{"rise": 0.2, "chest": 50.0}] * 20
    rise, chest = judged({"rise": (None, 0.3), "chest": (45.0, 60.0)}, few, many)
    assert (rise["met"], rise["grade"], rise["found"]["within"]) == (True, "attacked", 2)
    assert (chest["met"], chest["grade"], chest["found"]["within"]) == (False, "sampled", 0)
    assert (chest["found"]["case"], rise["found"]["case"]) == ({"u": 0}, None)
    assert (chest["found"]["low"], chest["found"]["high"]) == (40.0, 70.0)
    said = [requirement_text(asked, attacked="rise") for asked in (rise, chest)]
    assert said[0].startswith("Required, rise at most 0.3 m: pass, 0.1 to 0.3 m in the cases found, as ")
    assert (
        "as required in 2 of 2 of them and in 20 of 20 samples (with 95 % confidence at least 86 %" in said[0]
    )
    assert said[0].endswith("; attacked: an adversary looked for the worst.")
    assert said[1].startswith("Required, chest from 45 to 60: fail, 40 to 70 in the cases found, as ")
    assert said[1].endswith("sampled: the adversary looked for the worst of rise, not of this.")


def test_one_sample_beyond_fails_and_so_does_a_run_without_a_value():
    held = {"rise": 0.1}
    for sampled in ([held] * 19 + [{"rise": 0.5}], [held] * 19 + [None]):
        (asked,) = judged({"rise": (None, 0.3)}, [held], sampled)
        assert not asked["met"]
        assert asked["sampled"]["within"] == 19
        assert asked["sampled"]["case"] == {"u": 19}
        said = requirement_text(asked, attacked="rise")
        assert "fail, 0.1 to 0.1 m in the cases found, as required in 1 of 1 of them and in 19 of 20" in said
        assert "(with 95 % confidence 75.1 % to 99.9 % of" in said
    (asked,) = judged({"rise": (0.2, None)}, [None], [held] * 20)
    said = requirement_text(asked, attacked="rise")
    assert said.startswith("Required, rise at least 0.2 m: fail, no value in the cases found")
    assert "confidence at most 14 % of" in said


def test_a_loop_that_is_not_closed_passes_only_so_far():
    runs_of = [{"rise": 0.2}, {"rise": 0.28}]
    near, far = (judged({"rise": (None, high)}, runs_of, runs_of, loop=OPEN)[0] for high in (0.3, 0.4))
    assert near["may_reach"] == pytest.approx(0.28 * 1.12)
    said = [requirement_text(asked, attacked="rise") for asked in (near, far)]
    assert said[0].startswith(
        "Required, rise at most 0.3 m: pass so far, but another attack may find 0.3136 m, 0.2 to 0.28 m in "
    )
    assert said[1].startswith("Required, rise at most 0.4 m: pass, 0.2 to 0.28 m in")
    not_closed = "looked for the worst, and the loop is not closed."
    assert said[1].endswith(f"; searched: 480 true runs of an adversary {not_closed}")
    unknown = SimpleNamespace(**{**vars(OPEN), "may_exceed": float("inf")})
    asked, least = (
        judged({"rise": ends}, runs_of, runs_of, loop=unknown)[0] for ends in ((None, 9), (0.1, None))
    )
    assert asked["may_reach"] is None
    assert requirement_text(asked, attacked="rise").startswith(
        "Required, rise at most 9 m: pass so far, but how much more another attack may find is not known, 0.2"
    )
    assert "at least 0.1 m: pass, 0.2 to" in requirement_text(least, attacked="rise")
    untried = SimpleNamespace(**{**vars(OPEN), "worst": {"r": SimpleNamespace(value=0.28, attack=None)}})
    (alone,) = judged({"rise": (None, 0.4)}, runs_of, runs_of, loop=untried)
    assert requirement_text(alone, attacked="rise").endswith(f"; searched: no adversary has {not_closed}")
    del alone["attack_runs"]  # as in a document from before
    assert requirement_text(alone, attacked="rise").endswith("; searched: the loop is not closed.")
    (failed,) = judged({"rise": (None, 0.25)}, runs_of, runs_of, loop=OPEN)
    assert requirement_text(failed, attacked="rise").startswith("Required, rise at most 0.25 m: fail, 0.2")


@pytest.mark.slow
def test_a_loop_tells_what_is_required_first(tmp_path):
    text = STUDY + f"required = {{ push = [-inf, {ROBUST + 0.1}] }}\n"
    path = tmp_path / "two.toml"
    path.write_text(text)
    with Campaign(parse_study(text, path=path)) as campaign:
        (asked,) = campaign.run()["robust_layout"]["requirements"]
        folder = campaign.folder
    assert (asked["met"], asked["grade"], asked["low"]) == (True, "attacked", None)
    assert asked["found"]["high"] == pytest.approx(ROBUST, rel=0.02)
    page = write_report(folder).read_text()
    assert "<ol><li>Required, push at most 4.26" in page
    kept = json.loads((folder / "robust_layout.json").read_text())["requirements"]
    assert kept == [json.loads(json.dumps(asked))]


@pytest.mark.parametrize(
    ("required", "said"),
    [
        ("pull = [0, 1]", "no response 'pull'; the responses are push"),
        ("push = [-inf, inf]", r"required.push leaves both sides open. Leave it out"),
        (
            "push = [3, -inf]",
            r"required.push needs \[low, high\] with -inf for no lower and inf for no upper",
        ),
        ("push = [2, 1]", r"required.push needs \[low, high\], got \[2, 1\]"),
    ],
)
def test_what_cannot_be_required_is_refused(required, said):
    with pytest.raises(StudyError, match=said):
        parse_study(STUDY + f"required = {{ {required} }}\n")

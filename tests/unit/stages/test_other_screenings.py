"""Other looks at the runs of a campaign: `holdfast screen --method`, and `holdfast plan --factors`."""

import json
import textwrap

import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.report.contents import page_content
from workbench.report.lines.screening import other_screening_lines
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.other_screenings import OTHER_METHODS, other_screening
from workbench.stages.run_all import run_stage

STUDY = """
[study]
name = "bracket"
seed = 4

[model]
kind = "python"
function = "bracket.py:deflection"

[[parameter]]
name = "force"
lower = 0
upper = 2
unit = "kN"

[[parameter]]
name = "length"
lower = 1
upper = 3
unit = "m"

[[parameter]]
name = "paint"
lower = 0
upper = 1

[[parameter]]
name = "grease"
lower = 0
upper = 1

[[response]]
name = "deflection"
unit = "mm"

[design]
kind = "lhs"
runs = 24

[screen]
response = "deflection"
"""
MODEL = """
def deflection(force, length, paint, grease):
    {body}return force * length**3
"""


def campaign_of(folder, body=""):
    (folder / "bracket.py").write_text(textwrap.dedent(MODEL).format(body=body))
    (folder / "study.toml").write_text(STUDY)
    campaign = Campaign.from_file(folder / "study.toml")
    run_stage(campaign, "design")
    evaluate(campaign)
    return campaign


@pytest.fixture
def campaign(tmp_path):
    with campaign_of(tmp_path) as opened:
        yield opened


@pytest.mark.slow
@pytest.mark.parametrize("method", OTHER_METHODS)
def test_every_method_gives_a_document_with_names(campaign, method):
    document = other_screening(campaign, method)
    json.dumps(document, allow_nan=False)
    lines = other_screening_lines(document)
    assert max(map(len, lines)) < 200
    if method == "rivals":
        assert {one["method"] for one in document["rankings"]} >= {"default", "forest", "sobol"}
        first = next(one for one in document["rankings"] if one["method"] == "default")
        assert set(first["selected"]) == {"force", "length"}
    elif method in ("forward", "welch"):
        # as published, the inert inputs may leave the pool first: the active two share the common theta then
        assert set(document["ranking"]) == {"force", "length", "paint", "grease"}
    else:
        assert set(document["ranking"][:2]) == {"force", "length"}
    # the study's own screening is not touched
    assert not (campaign.folder / "screening.json").exists()


def test_a_response_over_decades_is_looked_at_on_its_scale(tmp_path):
    (tmp_path / "bracket.py").write_text(
        "import math\n"
        "def deflection(force, length, paint, grease):\n"
        "    return math.exp(4 * force / 20 + 2 * math.log(length) ** 2)\n"
    )
    (tmp_path / "study.toml").write_text(STUDY + 'transform = "log"\n')
    with Campaign.from_file(tmp_path / "study.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        sobol, rivals = other_screening(campaign, "sobol"), other_screening(campaign, "rivals")
        hybrid = other_screening(campaign, "hybrid")
    assert sobol["scale"] == "log"
    words = " ".join(" ".join(other_screening_lines(sobol)).split())
    assert "on another scale (log), carried back" in words
    words = " ".join(" ".join(other_screening_lines(rivals)).split())
    assert "all by the logarithm of the response" in words
    assert hybrid["scale"] == "the logarithm of the response"
    assert "screened by the logarithm of the response" in other_screening_lines(hybrid)
    assert set(hybrid["agreed"]) == {"force", "length"}


def test_bands_are_said_of_what_has_them(campaign):
    said = {
        name: other_screening_lines(other_screening(campaign, name))[1].strip() for name in ("hsic", "src")
    }
    assert said["hsic"].endswith("runs")
    assert said["src"].endswith("runs; in brackets 95 % bands")


STUDY_OF_TWO = STUDY.replace("[design]", '[[response]]\nname = "weight"\nunit = "kg"\n\n[design]')


def test_another_response_by_name(tmp_path):
    (tmp_path / "bracket.py").write_text(
        "def deflection(force, length, paint, grease):\n"
        "    return {'deflection': force * length**3, 'weight': 3 * paint + length}\n"
    )
    (tmp_path / "study.toml").write_text(STUDY_OF_TWO)
    with Campaign.from_file(tmp_path / "study.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        found = other_screening(campaign, response="weight")
        assert (found["response"], found["method"]) == ("weight", "default")
        assert set(found["selected"]) == {"paint", "length"}
        assert not (campaign.folder / "screening.json").exists()
        assert other_screening(campaign, "src", response="weight")["ranking"][:2] == ["paint", "length"]
        with pytest.raises(StudyError, match="no response 'mass'; the responses are deflection, weight"):
            other_screening(campaign, "src", response="mass")


def test_indices_are_kept_for_the_report(campaign):
    other_screening(campaign, "prcc")
    other_screening(campaign, "morris")
    other_screening(campaign, "sobol")
    other_screening(campaign, "prcc")
    kept = json.loads((campaign.folder / "sensitivity.json").read_text())["looks"]
    assert [look["method"] for look in kept] == ["morris", "prcc", "sobol"]
    page = page_content(campaign.folder)
    section = next(section for section in page.sections if section.id == "sensitivity")
    assert [block.title for block in section.blocks] == [
        "morris of deflection",
        "prcc of deflection",
        "sobol of deflection",
        "Interactions of pairs on deflection",
    ]
    assert section.blocks[1].rows[0][0] in ("force", "length")
    assert "It cannot see effects that are not monotone" in section.sentences[2]


def test_without_a_screen_table_a_response_has_to_be_named(tmp_path):
    (tmp_path / "bracket.py").write_text(textwrap.dedent(MODEL).format(body=""))
    (tmp_path / "study.toml").write_text(STUDY[: STUDY.index("[screen]")])
    with Campaign.from_file(tmp_path / "study.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        with pytest.raises(StudyError, match=r"no .screen. table, which names the response"):
            other_screening(campaign, "src")
        assert other_screening(campaign, "hsic", response="deflection")["ranking"][0] == "length"


def test_morris_makes_its_runs_once_and_beside_the_design(campaign):
    before = len(campaign.runs())
    first = other_screening(campaign, "morris", trajectories=2)
    assert first["n_runs"] == 2 * 5
    assert len(campaign.runs()) == before + 10
    assert other_screening(campaign, "morris", trajectories=2) == first
    assert len(campaign.runs()) == before + 10
    assert first["mu_star"]["paint"] == 0.0


def test_hybrid_reads_morris_and_stored_runs_together(campaign):
    document = other_screening(campaign, "hybrid")
    assert (document["n_runs"], document["stored_runs"]) == (4 * 5, 24)
    assert set(document["selected"]) == set(document["agreed"]) == {"force", "length"}
    assert document["disputed"] == []


def test_a_failed_run_takes_its_trajectory_with_it(tmp_path):
    broken = "\n    if paint > 0.3 and grease < 0.7 and force > 1.9:\n        raise ValueError('torn')\n    "
    with campaign_of(tmp_path, broken) as campaign:
        document = other_screening(campaign, "morris", trajectories=6)
    assert document["n_runs"] + document["n_left_out"] == 6 * 5
    assert document["n_left_out"] % 5 == 0


LABELLED = STUDY.replace(
    """[[response]]""",
    """[[parameter]]
name = "wood"
kind = "categorical"
levels = ["ash", "elm", "fir", "oak"]

[[parameter]]
name = "bolts"
kind = "integer"
lower = 2
upper = 5

[[response]]""",
)


@pytest.mark.parametrize("method", ["rivals", "hybrid"])
def test_labels_stay_labels(tmp_path, method):
    model = """
def deflection(force, length, paint, grease, wood, bolts):
    return {"ash": 0, "elm": 6, "fir": 1, "oak": 5}[wood] + force + 0.5 * bolts
"""
    (tmp_path / "bracket.py").write_text(model)
    (tmp_path / "study.toml").write_text(LABELLED.replace("runs = 24", "runs = 48"))
    with Campaign.from_file(tmp_path / "study.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        document = other_screening(campaign, method)
    if method == "hybrid":
        assert set(document["selected"]) == {"wood", "force", "bolts"}
        return
    for one in document["rankings"]:
        if one["method"] not in ("forward", "welch"):
            assert one["ranking"][0] == "wood", one["method"]


def test_groups_and_number_of_the_study_file_are_kept(tmp_path):
    (tmp_path / "bracket.py").write_text(MODEL.format(body=""))
    (tmp_path / "study.toml").write_text(STUDY + 'groups = [["length", "force"]]\nn_selected = 1\n')
    with Campaign.from_file(tmp_path / "study.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        assert set(run_stage(campaign, "screen")["selected"]) == {"length", "force"}
        assert set(other_screening(campaign, "forward")["selected"]) == {"length", "force"}


def test_failed_runs_are_told_in_words(tmp_path):
    with campaign_of(tmp_path, "raise ValueError('torn')\n    ") as campaign:
        with pytest.raises(
            NotEnoughRuns, match=r"0 of 24 runs gave a value, .*: 24 failed\. `holdfast failures`"
        ):
            run_stage(campaign, "screen")


def test_a_constant_response_is_refused_by_name(tmp_path):
    with campaign_of(tmp_path, "return 3.0\n    ") as campaign:
        with pytest.raises(StudyError, match=r"rivals cannot rank 'deflection': y is 3 in all 24 runs"):
            other_screening(campaign, "rivals")


def test_bad_requests_are_refused_with_a_cure(campaign):
    with pytest.raises(StudyError, match=r"one of default, forward, .*hybrid, got 'magic'"):
        other_screening(campaign, "magic")


def test_command_line(campaign, capsys):
    from tests.unit.terminal.test_cli import in_process

    campaign.close()
    study = campaign.folder.parent / "study.toml"
    code, out, _ = in_process("screen", study, "--method", "morris", "--json", capsys=capsys)
    assert code == 0
    assert json.loads(out)["ranking"][0] in {"force", "length"}
    code, out, err = in_process("screen", study, "--method", "magic", capsys=capsys)
    assert code == 2
    assert "got 'magic'" in err
    code, out, _ = in_process("plan", "--factors", 5, "--actives", 2, "--trials", 4, capsys=capsys)
    assert code == 0
    assert "5 parameters, about 2 of them active" in out
    code, _, err = in_process("plan", capsys=capsys)
    assert code == 2
    assert "--factors" in err
    code, _, err = in_process("plan", "--factors", 3, "--actives", 5, capsys=capsys)
    assert code == 2
    assert "1 <= active <= inputs" in err

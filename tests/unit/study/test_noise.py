"""`[worst_case] noise`: repeated runs in the store, the mean on page and terminal, what is refused."""

import pytest

from workbench.errors import StudyError
from workbench.report.lines.worst_case import worst_case_lines
from workbench.report.writing import write_report
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage
from workbench.stages.validation import check_study
from workbench.study.loading import parse_study

STUDY = """
[study]
name = "s"
[model]
{model}
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "load"
unit = "N"
[evaluate]
engine = "inline"
[worst_case]
response = "load"
{more}
"""
CALLED = 'kind = "python"\nfunction = "noisy.py:f"'
MODEL = """
import random
DRAWN = random.Random(1)
def f(a, b):
    return a + 0.5 * b + DRAWN.gauss(0.0, 0.15)
"""


def test_the_mean_is_on_page_and_terminal_and_its_runs_are_stored(tmp_path):
    (tmp_path / "noisy.py").write_text(MODEL)
    (tmp_path / "s.toml").write_text(STUDY.format(model=CALLED, more="noise = true\nbudget = 25"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        document = run_stage(campaign, "worst_case")
        assert run_stage(campaign, "worst_case") == document  # nothing is run again
        made = campaign.runs()
    at_point = [row for row in made if dict(row.inputs) == document["parameters"]]
    assert len(made) == document["evaluations"] == 25
    assert len({row.key for row in at_point}) == len(at_point) >= document["repeats"] == 5
    assert document["value"] == document["mean"]
    assert max(row.outputs["load"] for row in made) > document["value"]
    text = "\n".join(worst_case_lines(document))
    assert "the mean of 5 runs, +- " in text
    assert "N with 95 % confidence; 25 runs of at most 25" in text
    page = write_report(campaign.folder).read_text()
    assert "the mean of 5 runs, +- " in page
    assert "a single run beyond it is luck" in page
    assert "Confirmed by a true run" not in page


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("attack = 50", r"noise = true does not go with attack, which takes every run for exact\. Leave one"),
        ("lipschitz = 2.0", "noise = true does not go with lipschitz"),
        ("quantile = 0.9", "noise = true does not go with quantile"),
        ('transform = "log"', "transform = 'log' does not go with noise = true: the mean is searched"),
    ],
)
def test_what_takes_runs_for_exact_is_refused(tmp_path, more, message):
    text = STUDY.format(model=CALLED, more=f"noise = true\n{more}")
    with pytest.raises(StudyError, match=message):
        check_study(parse_study(text, path=tmp_path / "s.toml"))


def test_a_table_cannot_be_run_again(tmp_path):
    text = STUDY.format(model='kind = "table"\nfile = "t.csv"', more="noise = true")
    with pytest.raises(StudyError, match="noise = true needs a model that can be run again"):
        check_study(parse_study(text, path=tmp_path / "s.toml"))

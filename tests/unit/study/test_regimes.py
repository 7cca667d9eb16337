"""Regimes in a study: names in the file, drivers and switch on page and terminal, the worst case in one."""

import pytest

from workbench.errors import StudyError
from workbench.report.lines.screening import screening_lines
from workbench.report.lines.worst_case import worst_case_lines
from workbench.report.writing import write_report
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage
from workbench.study.loading import parse_study

STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "flight.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[parameter]]
name = "c"
lower = 0
upper = 1
[[response]]
name = "flight"
unit = "m"
regimes = {names}
[design]
runs = 40
[evaluate]
engine = "inline"
[screen]
response = "flight"
regimes = "{asked}"
[worst_case]
response = "flight"
budget = 3
"""
MODEL = """
def f(a, b, c):
    return 8.0 + 2.0 * c if a + b > 1.25 else 0.02 + 0.3 * c
"""


@pytest.mark.slow
def test_a_study_says_which_regime_it_speaks_of(tmp_path):
    (tmp_path / "flight.py").write_text(MODEL)
    (tmp_path / "s.toml").write_text(STUDY.format(names='["held", "left the vehicle"]', asked="auto"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        screening = run_stage(campaign, "screen")
        worst = run_stage(campaign, "worst_case")
    assert any(line.startswith("of 40 runs ") for line in screening_lines(screening))
    assert worst_case_lines(worst)[0].startswith("Worst case (largest flight): left the vehicle, ")
    assert 'It lies in the regime "left the vehicle", above' in " ".join(worst_case_lines(worst))
    page = write_report(campaign.folder).read_text().replace("&quot;", '"').replace("&#34;", '"')
    assert "Of 40 runs " in page
    assert "Left the vehicle: flight = " in page
    assert "It is switched by" in page
    assert 'It lies in the regime "left the vehicle", above' in page


def test_off_and_a_wrong_number_of_names(tmp_path):
    found = parse_study(STUDY.format(names='["held", "gone"]', asked="off"), path=tmp_path / "s.toml")
    assert found.screen["regimes"] == "off"
    assert found.response("flight").regimes == ("held", "gone")
    with pytest.raises(StudyError, match="regimes"):
        parse_study(STUDY.format(names='["held"]', asked="auto"), path=tmp_path / "s.toml")
    with pytest.raises(StudyError, match="needs two different names"):
        parse_study(STUDY.format(names='["held", "held"]', asked="auto"), path=tmp_path / "s.toml")

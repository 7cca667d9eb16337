"""A study beside its CSV: units that the header names, and columns that are called so but for their unit."""

import pytest

from workbench.errors import StudyError
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage
from workbench.stages.validation import check_study
from workbench.study.loading import load_study

STUDY = """
[study]
name = "s"
[model]
kind = "table"
file = "runs.csv"
{columns}
[[parameter]]
name = "mass"
lower = 0
upper = 9
{unit}
[[response]]
name = "y"
unit = "MPa"
"""
ROWS = ["1,2", "2,3.5", "3,4", "4,6"]


@pytest.fixture
def study(tmp_path):
    def of(header, *, columns="", unit='unit = "kg"'):
        (tmp_path / "runs.csv").write_text("\n".join([header, *ROWS]))
        (tmp_path / "s.toml").write_text(STUDY.format(columns=columns, unit=unit))
        return tmp_path / "s.toml"

    return of


MASS = 'columns = { mass = "mass [g]" }'


def test_a_column_in_another_unit_is_refused_before_anything_is_made_of_it(study, tmp_path):
    path = study("mass [g],y", columns=MASS)
    said = (
        r"line 6: runs.csv: the column 'mass \[g\]' is in g, and parameter 'mass' of the study in kg. "
        r'Convert the column or write unit = "g" in the study, with bounds and limits in it; if it is'
    )
    with pytest.raises(StudyError, match=said):
        check_study(load_study(path))
    with (
        Campaign.from_file(path) as campaign,
        pytest.raises(StudyError, match=r"the column 'mass \[g\]' is in g"),
    ):
        run_stage(campaign, "design")
    assert not (tmp_path / "s.holdfast" / "design.json").exists()


def test_so_is_a_response(study):
    path = study("mass,S (Pa)", columns='columns = { y = "S (Pa)" }')
    with pytest.raises(StudyError, match=r"column 'S \(Pa\)' is in Pa, and response 'y' of the study in MPa"):
        check_study(load_study(path))


@pytest.mark.parametrize(
    ("header", "columns", "unit"),
    [
        ("mass [kg],y", 'columns = { mass = "mass [kg]" }', 'unit = "kg"'),
        ("mass [kg],y (N/mm^2)", 'columns = { mass = "mass [kg]", y = "y (N/mm^2)" }', 'unit = "kg"'),
        ("mass [g],y", MASS, ""),  # the study says no unit
        ("mass [stone],y", 'columns = { mass = "mass [stone]" }', 'unit = "kg"'),
        ("mass_kg,y", 'columns = { mass = "mass_kg" }', 'unit = "kg"'),
    ],
)
def test_what_agrees_or_is_not_known_goes_on(header, columns, unit, study):
    assert check_study(load_study(study(header, columns=columns, unit=unit)))["valid"]


def test_a_unit_behind_an_underscore_is_compared(study):
    path = study("mass_g,y", columns='columns = { mass = "mass_g" }')
    assert check_study(load_study(path))["valid"]  # one letter may be anything
    path = study("mass_mg,y", columns='columns = { mass = "mass_mg" }')
    with pytest.raises(StudyError, match="column 'mass_mg' is in mg"):
        check_study(load_study(path))


def test_a_missing_column_that_has_a_unit_is_named_with_the_line_to_write(study):
    with pytest.raises(StudyError) as refused:
        check_study(load_study(study("mass [kg],y_MPa")))
    assert str(refused.value).endswith(
        "runs.csv has no column 'mass', 'y'; it has mass [kg], y_MPa. Write in [model]: "
        'columns = { mass = "mass [kg]", y = "y_MPa" }'
    )
    line = str(refused.value).rpartition("Write in [model]: ")[2]
    assert check_study(load_study(study("mass [kg],y_MPa", columns=line)))["valid"]


def test_points_of_a_design_are_compared_too(study, tmp_path):
    path = study("mass,y")
    (tmp_path / "points.csv").write_text("mass_mg\n1\n2\n3\n")
    text = path.read_text().replace('kind = "table"\nfile = "runs.csv"', 'kind = "ask"')
    text = text.replace('name = "mass"', 'name = "mass_mg"')
    path.write_text(text + '[design]\nkind = "table"\nfile = "points.csv"\n')
    with pytest.raises(
        StudyError, match=r"points.csv: the column 'mass_mg' is in mg, and parameter 'mass_mg'"
    ):
        check_study(load_study(path))

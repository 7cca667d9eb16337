"""What the findings say of a screening with the layout in: what noise hides is open, not gone."""

import pytest

from workbench.report.contents import DOCUMENTS
from workbench.report.page.folder import CampaignFolder
from workbench.report.page.run_list import RunList
from workbench.report.sections.findings import _layout, _unrestrained, after_text, case_text, was_resolved
from workbench.report.sections.robust_layout import PLAIN, screenings_table
from workbench.robust_layout.cases import TRIVIAL


def screened(after, before, state, state_before="resolved"):
    return {
        "before": before, "after": after, "state": state, "state_before": state_before,
        "gained": [n for n in after if n not in before], "lost": [n for n in before if n not in after],
    }  # fmt: skip


def test_a_screening_that_saw_nothing_does_not_say_that_nothing_drives_it():
    (said,) = after_text({"screening": screened([], ["peak", "pulse"], "not resolved")})
    assert said == (
        "With the layout in, none of the parameters stands out from noise on the same runs: whether peak and "
        "pulse still do is open."
    )


@pytest.mark.parametrize(
    ("state", "word"),
    [
        ("resolved", "no longer pulse"),
        ("partly resolved", "not seen any more, which these runs do not settle: pulse"),
    ],
)
def test_what_is_lost_is_gone_only_where_the_screening_is_resolved(state, word):
    found = screened(["peak", "mass"], ["peak", "pulse"], state)
    (said,) = after_text({"screening": found})
    assert said == f"With the layout in, peak and mass drive it; new: mass; {word}."
    assert was_resolved(found) is (state == "resolved")


@pytest.mark.parametrize("state", ["partly resolved", "not resolved", ""])
def test_what_the_screening_before_could_not_see_is_not_called_new(state):
    found = screened(["peak", "mass", "force"], ["peak"], "resolved", state)
    (said,) = after_text({"screening": found})
    assert said == (
        "With the layout in, peak, mass and force drive it; seen only now, which the runs without restraints "
        "do not settle: mass and force."
    )


@pytest.mark.parametrize(("state", "unseen"), [("resolved", "–"), ("not resolved", "open")])
def test_the_table_says_of_both_screenings_what_they_left_open(state, unseen):
    table = screenings_table({"screening": screened(["peak", "mass"], ["peak", "pulse"], state, state)})
    assert table.rows == (("peak", "yes", "yes"), ("pulse", "yes", unseen), ("mass", unseen, "yes"))


def test_a_document_that_tells_no_state_claims_nothing():
    old = {"verdict": "resolved: all", "before": ["peak"], "after": ["peak"]}
    assert not was_resolved(old)
    assert not was_resolved(old, before=True)


def test_the_same_parameters_as_before():
    (said,) = after_text({"screening": screened(["peak"], ["peak"], "resolved")})
    assert said == "With the layout in, peak drives it, as before."


@pytest.mark.parametrize(
    ("name", "subject"), [("robust", "The robust layout"), ("uniform", "The layout 'uniform'")]
)
def test_the_layout_returned_has_the_name_of_the_tables_and_is_held_beside_the_same_budgets(name, subject):
    layouts = {
        "uniform": {"worst": 2.0, "nominal": 1.0}, "nominal only": {"worst": 4.0, "nominal": 0.5},
        "robust": {"worst": 1.0, "nominal": 0.75},
    }  # fmt: skip
    said = _layout({"robust": name, "layouts": layouts, "status": "Closed."}, "m")
    assert said[0].startswith(f"{subject} keeps it at or below {layouts[name]['worst']:g} m in every case")
    assert ("below the same budgets spread evenly (2 m)" in said[0]) == (name == "robust")


class Folder(dict):
    """As much of a campaign's folder as a case takes to be told."""

    parameters = ("force", "payload", "struck")

    def unit_of(self, name):
        return {"force": "N", "payload": "kg"}.get(name, "1")


def test_a_case_says_that_what_it_does_not_name_is_nominal():
    """A worst case at the nominal payload named none, and could not be run again from the page."""
    folder, nominal = Folder(screening=None), {"force": 60.0, "payload": 3.25, "struck": "tip"}
    case = {**nominal, "force": 90.0}
    assert case_text(folder, case, nominal) == "force = 90 N, the rest nominal"
    whole = "force = 60 N, payload = 3.25 kg, struck = tip"
    assert case_text(folder, nominal, nominal) == case_text(folder, nominal) == whole
    other = {"force": 90.0, "payload": 6.0, "struck": "upper"}
    assert case_text(folder, other, nominal) == "force = 90 N, payload = 6 kg, struck = upper"


def test_the_page_knows_the_layouts_that_a_loop_is_compared_with():
    assert set(PLAIN) == set(TRIVIAL)  # the report may not import the loop


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (
            1.0,
            "0.463 m in the worst one of the loop (k = 4); "
            "the search for the worst case went to 1 m (k = 1).",
        ),
        (0.463 * (1 + 1e-13), "0.463 m in the worst one found (k = 4)."),
        (0.4, "0.463 m in the worst one found (k = 4)."),
    ],
)
def test_a_search_that_went_further_than_the_cases_of_the_loop_is_told(tmp_path, found, said):
    bare = {"nominal": 0.098, "worst": 0.463, "case": {"k": 4}}
    loop = {"response": "y", "layouts": {"none": bare}, "cases": [{"k": 2}]}
    worst = {"response": "y", "value": found, "sense": "max", "confirmed": True, "parameters": {"k": 1}}
    folder = CampaignFolder(
        path=tmp_path, lock={}, documents=dict.fromkeys(DOCUMENTS) | {"worst_case": worst}, runs=RunList()
    )
    begins = "Without restraints the y is 0.098 m in the nominal case and "
    assert [text.replace("\N{NO-BREAK SPACE}", " ") for text in _unrestrained(folder, loop, "m")] == [
        begins + said
    ]
    worst["response"] = "another"
    (text,) = _unrestrained(folder, loop, "m")
    assert "the search" not in text

"""No answer on the page is green over a record that speaks against it."""

import pytest

from workbench.errors import Contradiction
from workbench.report.sections.green_answers import refuse_green

AMBER = {"verdict": "amber", "reasons": ["the loop is not closed"]}
PROVED = {"confirmed": True, "grade": "proved"}


@pytest.mark.parametrize(
    ("section", "records", "said"),
    [
        ("screening", {"screening": "not resolved"}, "the screening is not resolved"),
        ("fit", {"screening": "not resolved"}, "the screening is not resolved"),
        ("layout", {"layout": {"converged": False}}, "its optimiser stopped at its limit"),
        ("layout", {"loop": AMBER}, "the loop is not closed"),
        ("robust", {"loop": AMBER}, "the loop is not closed"),
        ("robust", {"robust": {"summaries": [{"beyond_limit": [0.1, 0, 1]}]}}, "scenarios exceed the limit"),
        ("worst-case", {"worst": {"worst-case": {**PROVED, "confirmed": False}}}, "no run was made there"),
        (
            "worst-case",
            {"worst": {"worst-case": {**PROVED, "grade": "searched"}}},
            "only the search has looked",
        ),
        (
            "worst-case-z",
            {"worst": {"worst-case": PROVED, "worst-case-z": {**PROVED, "border": {"borders": True}}}},
            "it borders on failures",
        ),
    ],
)
def test_a_green_answer_over_a_record_that_speaks_against_it_is_refused(section, records, said):
    fine = {
        "screening": "resolved",
        "layout": {"converged": True},
        "loop": None,
        "robust": {"summaries": [{"beyond_limit": [0.1, 0, 1]}, {"beyond_limit": [0.0, 0, 1]}]},
        "worst": {"worst-case": PROVED, "worst-case-z": {**PROVED, "border": {"borders": False}}},
    }
    refuse_green({section: "good"}, **fine)
    refuse_green({section: "fair"}, **{**fine, **records})
    with pytest.raises(
        Contradiction, match=f"section '{section}' is not written: it is green although {said}"
    ):
        refuse_green({section: "good"}, **{**fine, **records})

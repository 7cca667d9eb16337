"""What the findings say of a screening with the layout in: what noise hides is open, not gone."""

import pytest

from workbench.report.sections.findings import after_text, was_resolved

NOISE = "not resolved: no input explains the response better than noise does"


def screened(after, before, verdict):
    return {
        "before": before, "after": after, "verdict": verdict,
        "gained": [n for n in after if n not in before], "lost": [n for n in before if n not in after],
    }  # fmt: skip


def test_a_screening_that_saw_nothing_does_not_say_that_nothing_drives_it():
    (said,) = after_text({"screening": screened([], ["peak", "pulse"], NOISE)})
    assert said == (
        "With the layout in, none of the parameters stands out from noise on the same runs: whether peak and "
        "pulse still do is open."
    )


@pytest.mark.parametrize(
    ("verdict", "word"),
    [
        ("resolved: what is not selected explains less than 1 %", "no longer pulse"),
        ("partly resolved: 9 % may hide", "not seen any more, which these runs do not settle: pulse"),
    ],
)
def test_what_is_lost_is_gone_only_where_the_screening_is_resolved(verdict, word):
    found = screened(["peak", "mass"], ["peak", "pulse"], verdict)
    (said,) = after_text({"screening": found})
    assert said == f"With the layout in, peak and mass drive it; new: mass; {word}."
    assert was_resolved(found) is verdict.startswith("resolved")


def test_the_same_parameters_as_before():
    (said,) = after_text({"screening": screened(["peak"], ["peak"], "resolved: all")})
    assert said == "With the layout in, peak drives it, as before."

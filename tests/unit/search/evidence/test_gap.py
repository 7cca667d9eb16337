"""The sentence about the remaining gap: written once, with its unit, and read everywhere."""

from math import inf

import pytest

from workbench.report.lines.worst_case import worst_case_lines
from workbench.report.worst_case.section import gap_sentence
from workbench.search.evidence.gap import Gap
from workbench.search.worst_case import worst_case
from workbench.space.box import Space
from workbench.space.parameter import Parameter

POINT = {"upper": 3.0, "width": 0.123456, "unit": "mm"}


@pytest.mark.parametrize(
    ("gap", "sentence"),
    [
        (
            Gap(**POINT, coverage=0.95, kind="model-based"),
            "By the Kriging with 95 % confidence it could be at most 0.1235 mm worse "
            "(model-based, not a proof).",
        ),
        (
            Gap(**POINT, coverage=0.9, kind="model-based", subject="the mean"),
            "By the Kriging with 90 % confidence the mean could be at most 0.1235 mm worse "
            "(model-based, not a proof; of what noise hides from all runs it says nothing).",
        ),
        (
            Gap(**POINT, coverage=1.0, kind="Lipschitz"),
            "With the given Lipschitz constant it is certain that at most 0.1235 mm more is possible.",
        ),
        (
            Gap(**POINT, coverage=1.0, kind="enclosure", calls=9),
            "By the given interval enclosure it is certain that at most 0.1235 mm more is possible.",
        ),
        (
            Gap(**POINT, coverage=1.0, kind="enclosure", calls=9, closed=False),
            "By the given interval enclosure it is certain that at most 0.1235 mm more is possible; "
            "more calls of it would narrow this.",
        ),
        (
            Gap(upper=1.0, width=0.0, coverage=1.0, kind="enumerated"),
            "Every point of the space was run: nothing worse exists.",
        ),
        (
            Gap(upper=inf, width=inf, coverage=0.95, kind="enumerated", failed=1),
            "Every point of the space was run; 1 failed and may be worse, by an unknown amount.",
        ),
        (
            Gap(upper=1.0, width=2.0, coverage=0.95, kind="enumerated", failed=2, note="two runs differ."),
            "Every point of the space was run; 2 failed and may be worse, by 2. Two runs differ.",
        ),
    ],
)
def test_every_kind_of_gap_has_its_sentence(gap, sentence):
    assert gap.sentence == sentence
    assert gap.to_dict()["sentence"] == sentence


def test_result_document_terminal_and_report_show_one_sentence_with_the_unit():
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    found = worst_case(lambda a, b: a + b, space, budget=8, seed=0).named("load", "kN/m^2")
    document = found.to_dict()
    said = found.gap.sentence
    assert " kN/m^2 worse" in said
    assert document["gap"]["sentence"] == said
    assert said in " ".join(" ".join(worst_case_lines(document)).split())
    assert gap_sentence(document) == said.replace("m^2", "m\N{SUPERSCRIPT TWO}").replace(
        " %", "\N{NO-BREAK SPACE}%"
    )

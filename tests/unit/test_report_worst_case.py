"""What the report says about a worst case that the search has just found."""

import pytest

from workbench.report_sections.gap_figure import gap_figure
from workbench.report_sections.worst_case import gap_sentence
from workbench.report_sections.worst_case_figures import baseline_figures
from workbench.space import Parameter, Space
from workbench.worst_case import worst_case

BOX = Space([Parameter("a", lower=-1.0, upper=2.0, unit="m"), Parameter("b", lower=0.0, upper=1.0)])


@pytest.fixture(scope="module")
def document():
    return worst_case(lambda a, b: a * a - b, BOX, budget=12, seed=0).to_dict()


def test_plain_searches_stand_beside_ours(document):
    (figure,) = baseline_figures(document, "height", "m")
    rows = {row[0]: row for row in figure.table.rows}
    assert rows["this search"][2] == 4.0
    assert {"Latin hypercube", "random corners"} <= set(rows)
    for name, row in rows.items():
        assert row[3] <= row[2] <= row[4], name
        assert row[2] <= 4.0 + 1e-6
    assert "predicted by the Kriging" in figure.read_off


def test_without_baselines_nothing_is_shown():
    assert baseline_figures({"value": 1.0}, "height", "m") == []


def test_the_gap_is_told_in_a_sentence(document):
    said = gap_sentence(document).replace("\N{NO-BREAK SPACE}", " ")
    assert "By the Kriging with 95 % confidence it could be at most" in said
    certified = {"unit": "m", "gap": {"width": 2.0, "kind": "Lipschitz"}}
    assert "it is certain that at most" in gap_sentence(certified)


def test_the_gap_is_drawn_beside_the_worst_so_far(document):
    figure = gap_figure(document, document["history"], "height", "m")
    assert [column.heading for column in figure.table.columns][2:5] == [
        "bound [m]", "gap [m]", "share of the range seen [%]",
    ]  # fmt: skip
    first, last = figure.table.rows[0], figure.table.rows[-1]
    assert (last[3], last[6]) == (document["gap"]["width"], "full")
    assert first[4] == pytest.approx(100.0 * document["gap_history"][0]["share"])
    assert "quick looks" in figure.read_off
    assert "after 12" in figure.alt


def test_a_gap_that_was_stated_once_has_no_history(document):
    assert gap_figure({**document, "gap_history": document["gap_history"][:1]}, [], "height", "m") is None
    assert gap_figure({"response": "height"}, [], "height", "m") is None  # of an earlier version

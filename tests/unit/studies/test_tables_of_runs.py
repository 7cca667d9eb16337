"""What is claimed of tables of runs holds against the tables; the study draws 200 of them."""

import csv

import pytest

from studies.tables_of_runs import Drawn, contradictions, drawn_study

QUICK, MORE = (14,), range(20)


@pytest.mark.parametrize("number", QUICK)
def test_a_drawn_table_is_not_contradicted(number, tmp_path):
    assert contradictions(drawn_study(7, number, tmp_path), page=False) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", MORE)
def test_more_drawn_tables_and_their_pages(number, tmp_path):
    assert contradictions(drawn_study(8, number, tmp_path), page=number % 8 == 0) == []


def test_rows_that_the_design_leaves_out_and_rows_without_another_response_are_known(tmp_path):
    """The worst row is the last, which `runs` leaves out; the next worst has no z and counts as failed."""
    rows = [(0.1 * k, (k * 3) % 7, 0.2 * k, 1.0 + k % 3) for k in range(8)]
    rows += [(0.5, 6.5, 50.0, ""), (0.6, 0.5, 99.0, 2.0)]
    with open(tmp_path / "runs.csv", "w", newline="") as file:
        csv.writer(file).writerows([("p0", "p1", "y", "z"), *rows])
    study = tmp_path / "study.toml"
    text = '[study]\nname = "s"\n[model]\nkind = "table"\nfile = "runs.csv"\n'
    for name, upper in (("p0", 1.0), ("p1", 7.0)):
        text += f'[[parameter]]\nname = "{name}"\nlower = 0.0\nupper = {upper}\n'
    text += '[[response]]\nname = "y"\n[[response]]\nname = "z"\n[worst_case]\nresponse = "y"\n'
    study.write_text(text + '[design]\nkind = "table"\nruns = 9\n')
    drawn = Drawn(path=study, way="one", ignored=())
    assert contradictions(drawn, page=False) == []
    study.write_text(text.replace('name = "s"', 'name = "t"'))
    (tmp_path / "runs.csv").write_text((tmp_path / "runs.csv").read_text().replace("0.6,0.5,99.0,2.0\n", ""))
    assert contradictions(drawn, page=False) == []


@pytest.mark.slow
def test_the_comparison_finds_what_is_seeded(tmp_path):
    """Against a table that has become worse since, and a study that was said to ignore nothing."""
    drawn = drawn_study(7, 14, tmp_path)
    assert contradictions(drawn, page=False) == []
    wrong = Drawn(path=drawn.path, way=drawn.way, ignored=("who",))
    assert any("who is not named in the terminal" in said for said in contradictions(wrong, page=False))

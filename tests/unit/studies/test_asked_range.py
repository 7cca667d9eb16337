"""A study counts the seeds FIRST to LAST - 1, and refuses to count none."""

import runpy
import sys

import pytest

from studies.asked_range import asked_range

STUDIES = (
    "border_kinds", "failure_border", "noisy_worst_case", "other_games", "rough_means", "rough_screening",
    "screening_lists", "screening_scales", "two_peak_games", "worst_case_calibration",
    "worst_case_gallery",
)  # fmt: skip


def test_first_to_last():
    assert asked_range(["2000", "2010"]) == range(2000, 2010)
    assert asked_range([], default=(0, 2)) == range(2)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["40", "10"], r"and 40 10 holds none: for 10 from 40 on, give 40 50"),
        (["7", "7"], r"and 7 7 holds none"),
        (["3", "-2"], r"and 3 -2 holds none$"),
        (["40"], r"needs two whole numbers FIRST LAST, got 40"),
        (["40", "ten"], r"needs two whole numbers FIRST LAST, got 40 ten"),
    ],
)
def test_what_holds_none_is_refused(words, message):
    with pytest.raises(SystemExit, match=message):
        asked_range(words)


@pytest.mark.parametrize("arguments", [("40", "10"), ("40",)])
@pytest.mark.parametrize("study", STUDIES)
def test_studies_refuse_to_count_nothing(study, arguments, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [study, *arguments])
    monkeypatch.delitem(sys.modules, f"studies.{study}", raising=False)
    with pytest.raises(SystemExit, match="FIRST LAST"):
        runpy.run_module(f"studies.{study}", run_name="__main__")
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(("study", "what"), [("failure_border", "drawn"), ("solver_decks", "tables")])
def test_so_do_those_that_first_ask_what(study, what, monkeypatch):
    monkeypatch.setattr(sys, "argv", [study, what, "40", "10"])
    monkeypatch.delitem(sys.modules, f"studies.{study}", raising=False)
    with pytest.raises(SystemExit, match="for 10 from 40 on"):
        runpy.run_module(f"studies.{study}", run_name="__main__")

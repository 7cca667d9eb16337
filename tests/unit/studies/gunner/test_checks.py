"""One command prints every row of the specification: the quick part of it, and what it refuses."""

import importlib

import pytest

from studies.gunner.checks import metrics

command = importlib.import_module("studies.gunner.checks.__main__")


def test_figures_of_merit_and_restraints_pass(capsys):
    assert command.main(["metrics"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "15 of 15 rows pass"
    assert {line.split()[0] for line in lines[:-1]} == {"M1", "M2", "M3", "R1", "R2"}


def test_a_miss_is_counted_and_named(capsys, monkeypatch):
    monkeypatch.setattr(metrics, "GRAVITY", 9.9)  # not the gravity of the criteria
    monkeypatch.setattr(command, "PARTS", {"metrics": lambda: metrics.table((metrics.injuries,))})
    command.main([])
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "1 of 2 rows pass", "  missed: M1 HIC15 of 100 g over 10 ms",
    ]  # fmt: skip


def test_the_weighting_is_that_of_the_printed_table():
    for f, printed in ((1.0, 0.482), (2.0, 0.531), (4.0, 0.967), (8.0, 1.036), (16.0, 0.769), (31.5, 0.405)):
        assert metrics.wk(f) == pytest.approx(printed, abs=6e-4)


def test_parts_that_there_are_not_are_named(capsys):
    assert command.main(["tyres"]) == 2
    assert "parts are metrics, vehicle, gunner, contacts, got tyres" in capsys.readouterr().out

"""Very many runs: a Kriging model and a page get some of them, and it is said."""

import re
from collections import Counter

import numpy as np
import pytest

from workbench.campaign.results.columns import run_columns
from workbench.campaign.results.thinning import spread_runs
from workbench.models.evaluator import response_reader
from workbench.report.sections import runs as runs_page
from workbench.space.streams import stream
from workbench.stages import screen
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import report, run_stage

STUDY = """
[study]
name = "many"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "y"
[design]
kind = "lhs"
runs = 120
[screen]
response = "y"
[evaluate]
engine = "inline"
"""
CODE = """
def f(a, b):
    if 0.4 < b < 0.6:
        raise ValueError("solver diverged")
    return 3 * a + b
"""


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "m.py").write_text(CODE)
    (tmp_path / "many.toml").write_text(STUDY)
    with Campaign.from_file(tmp_path / "many.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        yield campaign


def test_the_runs_that_spread_most_are_chosen_with_both_ends(campaign):
    runs = campaign.runs()
    columns = run_columns(
        [runs[:50], [], runs[50:]], {"y": response_reader("y")}, lambda keys: campaign.store.rows(keys=keys)
    )
    assert columns.counts == Counter(run.status for run in runs)
    chosen = columns.at(spread_runs(campaign.study.space, columns, "y", most=12, rng=stream(1, "t")))
    good = [run for run in chosen if run.status == "ok"]
    assert len(good) == 12
    assert len([run for run in chosen if run.status == "failed"]) == 12
    values = [run.outputs["y"] for run in runs if run.status == "ok"]
    kept = [run.outputs["y"] for run in good]
    assert (min(kept), max(kept)) == (min(values), max(values))
    assert [run.id for run in chosen] == sorted(run.id for run in chosen)
    space = campaign.study.space
    points = space.unit([[run.inputs[name] for name in space.names] for run in good])
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(12, 1)]
    assert gaps.min() > 0.12  # a random dozen: 0.04
    every = spread_runs(space, columns, "y", most=200, rng=stream(1, "t"))
    assert columns.at(every) == runs


def test_a_screening_says_that_it_took_some(campaign, monkeypatch):
    notes = []
    monkeypatch.setattr(screen, "MOST_RUNS", 30)
    monkeypatch.setattr(campaign.progress, "note", notes.append, raising=False)
    found = run_stage(campaign, "screen")
    assert any("of 120 runs are used: those that spread most over the box" in text for text in notes)
    assert found["selected"] == ["a", "b"]


def test_the_page_lists_some_and_counts_all(campaign, monkeypatch):
    monkeypatch.setattr(runs_page, "MOST_SHOWN", 20)
    text = report(campaign).read_text()
    assert re.search(r"y of (19|20|21) of", text)
    assert "120 runs: " in text
    assert len(text) < 2_000_000

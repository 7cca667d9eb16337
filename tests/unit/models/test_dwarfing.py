"""One run of a table that dwarfs all others is named; heavy tails are not."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.models.test_table import STUDY
from workbench.models.stored.dwarfing import dwarfing, dwarfing_sentence
from workbench.report.lines.design import design_lines
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_lines, run_stage
from workbench.stages.validation import check_study
from workbench.study.loading import load_study

TABLES = range(240)
MANY = range(1000, 7000)

TAILS = {
    "log-normal, half a decade": lambda rng, n: np.exp(rng.normal(0, 1.2, n)),
    "log-normal, a decade": lambda rng, n: np.exp(rng.normal(0, 2.3, n)),
    "undamped resonance": lambda rng, n: 1 / rng.uniform(-1, 1, n),
    "damped resonance": lambda rng, n: (lambda r: 1 / np.hypot(1 - r**2, 2e-3 * r))(rng.uniform(0.3, 2, n)),
    "clipped resonance": lambda rng, n: np.minimum(1 / np.abs(rng.uniform(-1, 1, n)), 1000.0),
    "blow-up by three decades": lambda rng, n: 1 / (1.001 - rng.random(n)),
    "growth": lambda rng, n: np.exp(14 * rng.random(n)),
    "Cauchy": lambda rng, n: rng.standard_cauchy(n),
    "contact": lambda rng, n: 5e3 * np.maximum(rng.random(n) - 0.85, 0),
    "smooth": lambda rng, n: np.sin(6 * rng.random(n)),
    "powers": lambda rng, n: rng.random(n) ** 9,
    "whole numbers": lambda rng, n: np.round(4 * rng.random(n)),
}


def table(number):
    rng = np.random.default_rng([303, number])
    return rng, list(TAILS.values())[number % len(TAILS)](rng, int(rng.integers(8, 60)))


@pytest.mark.parametrize("numbers", [TABLES, pytest.param(MANY, marks=pytest.mark.slow)], ids=len)
def test_no_heavy_tail_is_called_a_dwarfing_run(numbers):
    assert [number for number in numbers if dwarfing(table(number)[1].tolist())] == []


@pytest.mark.parametrize("numbers", [TABLES, pytest.param(MANY, marks=pytest.mark.slow)], ids=len)
def test_a_placeholder_is_found_in_any_of_them(numbers):
    """Missed are 20 of 6 000, of a contact that is open but in a few runs: nobody knows a tail of these."""
    missed = 0
    for number in numbers:
        rng, y = table(number)
        place = int(rng.integers(len(y)))
        y[place] = rng.choice([-1e30, 1e30])
        found = dwarfing(y.tolist())
        missed += found is None or found.runs != (place,)
        if found is not None:
            rest = np.delete(y, list(found.runs))
            assert (found.low, found.high) == (rest.min(), rest.max())
    assert missed <= 0.02 * len(numbers)


def test_several_placeholders_and_failed_runs():
    y = [*np.linspace(1, 3, 30), None, float("nan"), 1e30]
    assert dwarfing(y).runs == (32,)
    assert dwarfing([1e30, *y]).runs == (0, 33)
    assert dwarfing([1e30] * 6 + y) is None  # a tenth of the runs at most: these are no exception
    assert dwarfing([1e30, 1.0, 2.0, 3.0, 1.5]) is None  # of four others nobody knows the tail
    assert dwarfing([0.0] * 9 + [5.0]) is None  # a contact that closes once
    assert dwarfing([]) is None


SEEN = {"response": "y", "unit": "m/s^2", "file": "runs.csv", "low": 0.5, "high": 3.0}


def test_the_sentence_names_run_value_others_and_what_to_do():
    assert dwarfing_sentence({**SEEN, "lines": [4], "values": [1e30]}) == (
        "Line 4 of runs.csv gives y = 1e+30 m/s², all other runs from 0.5 to 3 m/s²: what is found of y "
        "rests on that one value. Where it is a placeholder, a run that failed or another unit, mend it or "
        "leave the cell empty; a true value may stay"
    )
    many = dwarfing_sentence({**SEEN, "unit": "1", "lines": [4, 9, 7, 5], "values": [1e30, 1e30, 1e29, 1e28]})
    assert many.startswith(
        "Lines 4, 9, 7 and 1 more of runs.csv give y = 1e+28 to 1e+30, all other runs from 0.5 to 3: what"
    )
    assert "rests on those values. Where they are a placeholder" in many


ROWS = [f"{0.3 * k:.1f},{3 + np.sin(k):.4f}" for k in range(24)]


@pytest.fixture
def study(tmp_path):
    def of(*rows, more=""):
        (tmp_path / "runs.csv").write_text("\n".join(["a,F [N]", *rows]))
        path = tmp_path / "s.toml"
        model = 'kind = "table"\nfile = "runs.csv"\ncolumns = { y = "F [N]" }'
        path.write_text(STUDY.format(model=model) + '[screen]\nresponse = "y"\n' + more)
        return path

    return of


def test_terminal_page_and_validate_say_it_and_all_stages_go_on(study):
    path = study(*ROWS[:10], "", "8.9,1e30", *ROWS[10:])
    assert check_study(load_study(path))["notes"][0].startswith("Line 13 of runs.csv gives y = 1e+30, all")
    with Campaign.from_file(path) as campaign:
        found = campaign.run()
        assert found["design"]["dwarfing"][0]["lines"] == [13]
        assert found["evaluate"]["counts"] == {"ok": 25}  # no run is dropped
        assert "screen" in found
    page = Path(found["report"]).read_text()
    assert "Line 13 of runs.csv gives y = 1e+30, all other runs from" in " ".join(run_lines(found))
    assert max(map(len, design_lines(found["design"]))) < 80
    assert page.count("Line 13 of runs.csv gives y =") >= 2  # of the card and of the section


def test_nothing_is_said_of_an_honest_table(study):
    path = study(*ROWS)
    assert check_study(load_study(path))["notes"] == []
    with Campaign.from_file(path) as campaign:
        assert "dwarfing" not in run_stage(campaign, "design")


def test_rows_that_the_design_leaves_out_are_not_looked_at(study):
    path = study(*ROWS, "8.9,1e30", more='[design]\nkind = "table"\nruns = 24\n')
    with Campaign.from_file(path) as campaign:
        assert "dwarfing" not in run_stage(campaign, "design")

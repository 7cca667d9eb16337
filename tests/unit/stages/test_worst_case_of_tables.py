"""The worst case of a table of runs: what it is stated against, and in which words."""

import pytest

from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_all

STUDY = """
[study]
name = "t"
[model]
kind = "table"
file = "t.csv"
[[parameter]]
name = "a"
lower = 0.0
upper = 1.0
[[response]]
name = "y"
[worst_case]
response = "y"
sense = "{sense}"
budget = 6
"""
LEVELS = [(3 * k % 14 + 0.5) / 14 for k in range(14)]


def document_of(tmp_path, values, *, sense="max"):
    """`worst_case.json` of a table of 14 runs with these values."""
    rows = [f"{a},{y}" for a, y in zip(LEVELS, values, strict=True)]
    (tmp_path / "t.csv").write_text("a,y\n" + "\n".join(rows) + "\n")
    (tmp_path / "t.toml").write_text(STUDY.format(sense=sense))
    with Campaign.from_file(tmp_path / "t.toml") as campaign:
        return run_all(campaign)["worst_case"]


@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("size", ["1e200", "-1e200", "1.1e140", "inf"])
def test_a_row_too_large_to_be_a_value_is_no_known_run(tmp_path, sense, size):
    values = [str(a * a) for a in LEVELS]
    values[5] = size
    document = document_of(tmp_path, values, sense=sense)
    assert -0.1 < document["value"] < 1.1
    assert document["failures"] == {"nonfinite": 1}

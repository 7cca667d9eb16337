"""The borehole study: the known corner, and the table in the repository is the one the script writes."""

import csv
import itertools
import tomllib

import pytest

from studies.borehole import BOX, MAXIMUM, RUNS, TABLE, borehole, worst_corner, write_table


def test_largest_flow_is_at_the_known_corner():
    corners = [
        dict(zip(BOX, c, strict=True)) for c in itertools.product(*((low, up) for low, up, _ in BOX.values()))
    ]
    flows = [borehole(**corner) for corner in corners]
    assert max(flows) == pytest.approx(MAXIMUM, abs=5e-8)  # printed with seven decimals
    assert corners[flows.index(max(flows))] == worst_corner()


def test_table_in_the_repository_is_what_the_script_writes(tmp_path):
    assert write_table(tmp_path / "borehole.csv").read_bytes() == TABLE.read_bytes()


def test_table_lies_in_the_box_and_fills_it():
    with TABLE.open() as file:
        table = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    assert len(table) == RUNS
    for name, (lower, upper, _) in BOX.items():
        column = sorted(row[name] for row in table)
        # one point per stratum of a Latin hypercube; rounding to six digits may move a point across an edge
        stratum = (upper - lower) / RUNS
        assert all(
            lower + (i - 0.01) * stratum <= v <= lower + (i + 1.01) * stratum for i, v in enumerate(column)
        )
    for row in table:
        flow = row.pop("flow")
        assert flow == borehole(**row)


def test_study_file_has_the_same_box_and_units():
    study = tomllib.loads(TABLE.with_suffix(".toml").read_text())
    assert {p["name"]: (p["lower"], p["upper"], p["unit"]) for p in study["parameter"]} == BOX

"""The worst case of given runs, without a model to run."""

import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.search.record import Status
from workbench.search.worst_case import surrogate_worst_case


@pytest.mark.slow
@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("power", [1, 3, 9])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_worst_case_is_no_better_than_a_known_run_and_its_bound_no_better_than_it(sense, power, seed):
    rng = np.random.default_rng(seed)
    space = Space([Parameter(f"x{i}", lower=-1, upper=2) for i in range(2)])
    rows = space.rows(rng.random((14, 2)))
    runs = [{**row, "y": sum(v**power for v in row.values())} for row in rows]
    found = surrogate_worst_case(space, runs, response="y", sense=sense)
    sign = 1.0 if sense == "max" else -1.0
    assert sign * found.value >= max(sign * run["y"] for run in runs)
    assert sign * found.gap.upper >= sign * found.value
    assert found.gap.width >= 0


def test_where_nothing_worse_is_predicted_the_worst_run_is_the_answer():
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    rows = space.rows(np.array([[i / 2, j / 2] for i in range(3) for j in range(3)]))
    runs = [{**row, "y": -((row["a"] - 0.5) ** 2) - (row["b"] - 0.5) ** 2} for row in rows]
    found = surrogate_worst_case(space, runs, response="y")
    assert found.status is Status.KNOWN_RUN
    assert found.confirmed
    assert found.value == 0.0
    assert dict(found.parameters) == {"a": 0.5, "b": 0.5}
    assert found.grade_sentence == (
        "Not searched: without a model to run, all that is known are the runs given and what a Kriging of "
        "them predicts."
    )


@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_a_prediction_beyond_a_run_by_rounding_alone_is_nothing(sense, offset):
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    rows = space.rows(np.array([[i / 3, j / 3] for i in range(4) for j in range(4)]))
    runs = [{**row, "y": offset + row["a"] + 0.2 * row["b"]} for row in rows]
    found = surrogate_worst_case(space, runs, response="y", sense=sense)
    assert found.status is Status.KNOWN_RUN
    assert found.value == runs[-1 if sense == "max" else 0]["y"]


def test_the_rows_of_a_table_are_no_even_sample_of_the_box():
    """They crowd where runs fail; how much of the box does is no share of the rows."""
    rng = np.random.default_rng(1)
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    points = np.vstack([rng.random((12, 2)) * [0.7, 1.0], [0.7, 0.0] + rng.random((12, 2)) * [0.3, 1.0]])
    runs = [{**row, "y": row["b"] if row["a"] < 0.7 else float("nan")} for row in space.rows(points)]
    border = surrogate_worst_case(space, runs, response="y").border
    assert border.counted.draws == 0
    assert "by the classifier alone, as no even sample was run" in border.sentence


def test_no_share_of_the_box_is_read_off_failures_that_are_scattered():
    rng = np.random.default_rng(2)
    space = Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(4)])
    rows = space.rows(rng.random((90, 4)))
    runs = [{**row, "y": row["x0"] + row["x1"] if k % 6 else float("nan")} for k, row in enumerate(rows)]
    border = surrogate_worst_case(space, runs, response="y").border
    assert (border.scattered, border.chance) == ((15, 90), 15 / 90)
    assert border.sentence.endswith(
        "15 of 90 runs failed and the classifier finds no region where they do, so what share of the box "
        "fails is not known."
    )

"""A diagnosis in the names of parameters and runs."""

import json

import numpy as np
import pytest

from surrogates import KrigingScreener
from workbench.screening.in_names import (
    diagnosis_in_names,
    judged_in_names,
    shares_in_names,
    step_in_names,
)
from workbench.space.box import Space
from workbench.space.parameter import Parameter

NAMES = ("grip", "mass", "seat")


@pytest.fixture(scope="module")
def screener():
    x = np.random.default_rng(2).random((30, 3))
    x[29] = x[28]
    return KrigingScreener().fit(x, np.sin(6 * x[:, 2]) + 2 * x[:, 0])


def test_columns_and_runs_have_their_names(screener):
    ids = [f"run {k}" for k in range(30)]
    found = diagnosis_in_names(screener.diagnosis_, screener.judgement(NAMES), NAMES, ids)
    assert json.loads(json.dumps(found)) == found  # plain types alone
    assert set(found["shares"]) == {"grip", "seat"}
    assert found["duplicates"] == [["run 28", "run 29"]]
    assert not {0, 1, 2} & {*found["confirmed"], *found["open"], *found["minor"]}


def test_a_step_and_the_shares_of_a_part_name_what_was_selected(screener):
    last = [step for step in screener.path_ if step.accepted][-1]
    step = step_in_names(last, NAMES)
    assert set(step["selected"]) == set(step["theta"]) == {"grip", "seat"}
    assert shares_in_names(screener, NAMES)["selected"] == [NAMES[k] for k in screener.selected_]


def test_the_verdict_names_what_stands_apart():
    x = np.random.default_rng(3).random((40, 3))
    found = KrigingScreener().fit(x, np.sin(3 * x[:, 2]) + 2 * x[:, 0] + 0.08 * x[:, 1])
    space = Space([Parameter(name, lower=0, upper=1) for name in NAMES])
    assert "listed apart, estimated below 1.0 % each: mass" in judged_in_names(found, space).verdict
    assert "listed apart, estimated below 1.0 % each: 1" in found.diagnosis_.verdict

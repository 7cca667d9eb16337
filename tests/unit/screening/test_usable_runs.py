"""Runs of any kind serve a screening: stored ones, outcomes of a search, rows."""

import numpy as np

from workbench.screening.usable_runs import usable_runs
from workbench.space.box import Space
from workbench.space.parameter import Parameter
from workbench.stages.campaign import Campaign

SPACE = Space([Parameter("a", lower=0, upper=2), Parameter("b", lower=0, upper=1)])


def test_what_a_campaign_evaluates_is_screened_as_it_comes(tmp_path):
    rows = [{"a": 0.5, "b": 0.1}, {"a": 1.0, "b": 0.9}, {"a": 1.5, "b": 0.4}, {"a": 2.0, "b": 0.2}]
    with Campaign.of(lambda a, b: a / (b > 0.15), SPACE, folder=tmp_path / "c") as campaign:
        runs = campaign.evaluate(rows)
    found = usable_runs(runs, SPACE, "y")
    assert found.n_left_out == 1
    assert found.ids == [run.key for run in runs[1:]]
    np.testing.assert_allclose(found.x[:, 0], [0.5, 0.75, 1.0])
    assert usable_runs([run.as_outcome() for run in runs], SPACE, "y").ids == found.ids

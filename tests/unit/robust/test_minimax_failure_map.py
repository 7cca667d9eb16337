"""Where the runs of a minimax search fail, by level of its unordered parameters."""

import json

import pytest

from workbench import Parameter, Space
from workbench.robust.minimax import MinimaxStatus, minimax
from workbench.search.evidence.grade import Grade

DESIGN = Space([Parameter("x", lower=0, upper=1), Parameter("seat", kind="categorical", levels=("a", "b"))])
UNCERTAIN = Space([Parameter("u", lower=0, upper=1), Parameter("belt", kind="binary")])


@pytest.fixture(scope="module")
def dark():
    """The belt off cannot be run with any design."""

    def model(x, u):
        if u["belt"] == 0:
            raise RuntimeError("no convergence")
        return (x["x"] - 0.4) ** 2 + u["u"] * (1 + x["x"]) + (x["seat"] == "a")

    return minimax(model, DESIGN, UNCERTAIN, budget=60, attack=60, seed=0)


def test_a_level_of_the_uncertainty_without_a_run_is_named_and_lowers_the_grade(dark):
    assert [level.level for level in dark.levels_without_a_run] == [0]
    assert (
        "Nothing is known of belt=0 at this design: no run of the attack gave a value there." in dark.sentence
    )
    assert "Runs fail more often at belt=0 (all" in dark.sentence
    assert dark.grade is Grade.SEARCHED
    assert dark.status is not MinimaxStatus.CONVERGED


def test_the_attack_covers_the_level_that_fails(dark):
    tried = [a.outcome.parameters["belt"] for a in dark.attack.attempts]
    assert tried.count(0) >= 10
    assert tried.count(1) > tried.count(0)  # climbs begin at cases that ran


def test_the_map_is_part_of_the_document(dark):
    document = json.loads(json.dumps(dark.to_dict()))
    belt = [level for level in document["failure_map"] if level["parameter"] == "belt"]
    assert sum(level["runs"] for level in belt) == dark.evaluations
    assert sum(level["failed"] for level in belt) == dark.failures

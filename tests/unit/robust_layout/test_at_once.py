"""Many cases of a layout in one call of its model: the answers of one by one, failures included."""

import numpy as np
import pytest

from studies.loop_rivals import box
from studies.occupant_braking import OccupantRestraint, restraint
from tests.sample_layout import TwoMembers
from workbench.models.protocol import ModelSpec
from workbench.robust_layout.runs import LayoutRuns
from workbench.space.box import Space
from workbench.space.parameter import Parameter

SPACE = Space((Parameter("u", lower=-1, upper=1), Parameter("v", lower=0, upper=1)))
LAYOUT = np.array([0.6, 0.4])
ROWS = [{"u": u, "v": 0.5} for u in (-1.0, -0.9, -0.5, 0.0, 0.5, 1.0)]


class Batches(TwoMembers):
    """Counts its calls; `call` may raise or give too few answers."""

    def __init__(self, call=None):
        super().__init__(unrunnable=-0.95)
        self.sizes, self.threads, self.call = [], [], call

    def responses_of_cases(self, density, cases, *, threads):
        self.sizes.append(len(cases))
        self.threads.append(threads)
        if self.call is not None:
            return self.call(cases)
        found = []
        for case in cases:
            try:
                found.append(self.responses(density, case))
            except RuntimeError as error:
                found.append(error)
        return found


def layout_runs(folder, model, identity="two", **options):
    spec = ModelSpec(
        kind="layout",
        options={
            "layouts": str(folder / "layouts"), "model": "tests.sample_layout:two_members", "options": {},
        },
        folder=".", names=SPACE.names, responses={"push": None}, identity=identity, version="1",
    )  # fmt: skip
    return LayoutRuns(folder, spec=spec, space=SPACE, model=model, seed=0, **options)


def outcomes(folder, model, rows=ROWS, **options):
    with layout_runs(folder, model, **options) as runs:
        return [(o.status, dict(o.outputs), o.error) for o in runs.of(LAYOUT)(rows, purpose="test")]


def test_a_batch_has_the_answers_of_single_runs(tmp_path):
    model = Batches()
    found = outcomes(tmp_path / "many", model, workers=3)
    assert found == outcomes(tmp_path / "single", TwoMembers(unrunnable=-0.95), inline=True)
    assert found[0] == ("failed", {}, "RuntimeError: this direction cannot be run")
    assert [status for status, _, _ in found[1:]] == ["ok"] * 5
    assert model.sizes == [6]
    assert model.threads == [3]


def test_runs_that_are_known_are_not_asked_for_again(tmp_path):
    model = Batches()
    outcomes(tmp_path, model, rows=ROWS[:4])
    outcomes(tmp_path, model)
    assert model.sizes == [4, 2]


def test_runs_of_a_model_that_was_mended_are_not_counted_with_those_of_the_new_one(tmp_path):
    outcomes(tmp_path, Batches())  # one fails
    with layout_runs(tmp_path, TwoMembers(), "mended", inline=True) as runs:
        runs.of(LAYOUT)(ROWS[1:], purpose="test")
        assert runs.counts() == {"ok": 5}


@pytest.mark.parametrize(
    "call", [lambda cases: 1 / 0, lambda cases: [{"push": 1.0}]], ids=["it raises", "too few answers"]
)
def test_a_call_that_fails_as_a_whole_is_made_case_by_case(tmp_path, call):
    found = outcomes(tmp_path / "many", Batches(call), inline=True)
    assert found == outcomes(tmp_path / "single", TwoMembers(unrunnable=-0.95), inline=True)


def test_a_study_that_limits_time_has_its_runs_in_processes(tmp_path):
    model = Batches()
    found = outcomes(tmp_path, model, rows=ROWS[1:3], timeout=60.0)
    assert [status for status, _, _ in found] == ["ok", "ok"]
    assert model.sizes == []


@pytest.mark.parametrize("threads", [1, 3])
def test_the_occupant_in_many_cases_is_the_occupant_in_each_to_the_bit(threads):
    model: OccupantRestraint = restraint(steps=100)
    rng = np.random.default_rng(5)
    density = np.zeros(model.members)
    density[rng.choice(180, 12, replace=False)] = 0.5
    density[180 + rng.choice(180, 12, replace=False)] = 0.5
    space = box(rng)
    cases = [space.canonical(row) for row in space.rows(rng.random((5, space.dimension)))]
    found = model.responses_of_cases(density, cases, threads=threads)
    assert found == [model.responses(density, case) for case in cases]

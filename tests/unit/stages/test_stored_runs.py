"""What stages start from, few runs or very many: the same, and memory that does not follow their number."""

import json
import tracemalloc
from hashlib import blake2b

import pytest

from workbench.campaign.results.functionals import known_outcomes
from workbench.models.evaluator import Outcome, response_reader
from workbench.models.protocol import Answer
from workbench.sampling.stored import design_keys
from workbench.search.known_runs import Stated, admitted, worst_beyond
from workbench.space.box import Parameter, Space
from workbench.stages import other_screenings, planning, stored_runs
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate, queue_design
from workbench.stages.planning import plan_study
from workbench.stages.run_all import run_stage
from workbench.stages.stored_runs import runs_as_text, screening_columns, thinned
from workbench.stages.up_to_date import fingerprint

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
runs = {runs}
[screen]
response = "y"
[worst_case]
response = "y"
[evaluate]
engine = "inline"
"""
CODE = """
def f(a, b):
    if 0.4 < b < 0.5:
        raise ValueError("solver diverged")
    return 3 * a + b
"""
FEW, MANY = 12_000, 36_000  # runs: designs and stores that are read in pieces
OF_A_RUN = 300  # bytes that all columns take of a run; as a record it takes 870


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "m.py").write_text(CODE)
    (tmp_path / "many.toml").write_text(STUDY.format(runs=60))
    with Campaign.from_file(tmp_path / "many.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        campaign.tell(None, 7.0, parameters={"a": 0.5, "b": 0.75})
        campaign.tell(None, failure="no convergence", parameters={"a": 0.5, "b": 0.25})
        campaign.enqueue([{"a": 0.1, "b": 0.1}], batch="told")  # without an answer
        yield campaign


def starting_runs(campaign):
    """The runs of the design and those that were told, one by one."""
    told = [run.key for run in campaign.runs() if run.batch == "told" and run.status != "queued"]
    return campaign.store.rows(keys=[*design_keys(campaign.folder / "design.json"), *told])


@pytest.mark.parametrize("at_once", [1, 7, 62, 5_000])
def test_runs_come_in_their_order_however_many_are_held(campaign, monkeypatch, at_once):
    monkeypatch.setattr(stored_runs, "AT_ONCE", at_once)
    runs = starting_runs(campaign)
    assert {run.status for run in runs} == {"ok", "failed"}
    assert len(runs) == 62
    columns = screening_columns(campaign, {"y": response_reader("y")})
    assert columns.at(range(len(columns))) == runs
    assert columns.is_ok.tolist() == [run.status == "ok" for run in runs]
    assert columns.values["y"][columns.is_ok].tolist() == [r.outputs["y"] for r in runs if r.status == "ok"]
    whole = json.dumps([[run.key, run.status, run.outputs] for run in runs])
    assert "".join(runs_as_text(campaign)) == whole


def test_a_fingerprint_is_that_of_the_whole_text(campaign):
    spec, table = campaign.spec, {"response": "y", "unit": "µm"}
    whole = json.dumps([[run.key, run.status, run.outputs] for run in starting_runs(campaign)])
    parts = [table, campaign.study.seed, campaign.study.space.hash, spec.identity, spec.version, whole]
    expected = blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=16).hexdigest()
    assert fingerprint(campaign, table, runs_as_text(campaign)) == expected
    assert fingerprint(campaign, table, ['["µ', '"]']) == fingerprint(campaign, table, ['["µ"]'])
    assert fingerprint(campaign, table, []) == fingerprint(campaign, table, [""]) != expected


def test_few_with_a_value_among_very_many_are_thinned_as_well(campaign, monkeypatch):
    monkeypatch.setattr(stored_runs, "AT_ONCE", 20)
    columns = screening_columns(campaign, {"y": response_reader("y")})
    good = int(columns.is_ok.sum())
    chosen = thinned(campaign, columns, "y", most=5)
    assert columns.is_ok[chosen].sum() == 5
    assert (~columns.is_ok[chosen]).sum() == 5
    assert columns.is_ok[thinned(campaign, columns, "y", most=good)].sum() == good


def test_known_runs_come_one_by_one_and_the_worst_of_them_is_found(campaign):
    runs = list(known_outcomes(campaign))
    assert [(run.key, run.status, run.outputs) for run in runs] == [
        (run.key, run.status, run.outputs) for run in campaign.runs()
    ]
    assert {run.error for run in runs if run.status == "failed"} == {
        "ValueError: solver diverged",
        "no convergence",
    }

    def stated(value, sense):
        return Stated(value=value, sense=sense, read=response_reader("y"), reads=("y",))

    values = [run.outputs["y"] for run in admitted(campaign.study.space, runs)]
    sought = [stated(3.0, "max"), stated(7.0, "max"), stated(1.0, "min"), stated(min(values), "min")]
    found = worst_beyond(campaign.study.space, iter(runs), sought)
    assert [[run.outputs["y"] for run in one] for one in found] == [[7.0], [], [min(values)], []]


def test_a_worse_run_outside_the_space_or_without_a_response_is_no_worst_one():
    space = Space([Parameter("a", lower=0, upper=1)], constraints=["a < 0.8"])

    def known(a, key, **outputs):
        return Outcome(parameters={"a": a}, status="ok", outputs=outputs, key=key)

    runs = [
        known(0.1, "first", y=2.0, z=0.0),
        known(0.2, "last", y=2.0, z=0.0),
        known(0.9, "breaks the constraint", y=9.0, z=0.0),
        known(1.5, "outside", y=9.0, z=0.0),
        known(0.3, "without z", y=9.0),
        known(0.3, "no number", y=float("inf"), z=0.0),
        Outcome(parameters={"a": 0.3}, status="failed", key="failed"),
    ]
    one = Stated(value=1.0, sense="max", read=response_reader("y"), reads=("y", "z"))
    ((worst,),) = worst_beyond(space, runs, [one])
    assert worst.key == "last"


def test_other_methods_take_as_many_runs_as_they_bear(campaign, monkeypatch):
    notes = []
    monkeypatch.setattr(campaign.progress, "note", notes.append, raising=False)
    monkeypatch.setattr(stored_runs, "AT_ONCE", 20)
    good = int(screening_columns(campaign, {}).is_ok.sum())
    monkeypatch.setattr(other_screenings, "MOST_RUNS", 24)
    monkeypatch.setattr(other_screenings, "MOST_PAIRS", 30)
    used = {
        method: other_screenings.other_screening(campaign, method)["n_runs"]
        for method in ("forward", "rivals", "sobol", "hsic", "src")
    }
    assert used == {"forward": 24, "rivals": 24, "sobol": 24, "hsic": 30, "src": good}
    assert f"30 of {good} runs with a value are used, drawn at random" in notes
    assert sum("those that spread most over the box" in note for note in notes) == 3


def test_the_plan_of_a_large_design_says_what_that_of_a_small_one_says(campaign, monkeypatch):
    study = campaign.study
    expected = plan_study(study)
    assert expected["design"]["sentence"].startswith("60 runs of the design")
    monkeypatch.setattr(planning, "MOST_ROWS", 10)
    monkeypatch.setattr(planning, "design_change", lambda *_, **__: pytest.fail("its points are read"))
    assert plan_study(study) == expected


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    found = {}
    for runs in (FEW, MANY):
        folder = tmp_path_factory.mktemp(str(runs))
        (folder / "m.py").write_text(CODE)
        (folder / "many.toml").write_text(STUDY.format(runs=runs))
        found[runs] = Campaign.from_file(folder / "many.toml")
        queue_design(found[runs], run_stage(found[runs], "design"))
        with found[runs].store.transaction():
            for k, key in enumerate(design_keys(found[runs].folder / "design.json")):
                found[runs].store.finish(key, Answer(status="ok", outputs={"y": k / 7}), attempt=1)
    yield found
    for campaign in found.values():
        campaign.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fingerprint", "columns", "known", "plan"])
def test_memory_is_that_of_columns(campaigns, name):
    stated = Stated(value=0.0, sense="max", read=response_reader("y"), reads=("y",))

    def columns(campaign):
        found = screening_columns(campaign, {"y": response_reader("y")})
        found.at(thinned(campaign, found, "y", most=100))

    work = {
        "fingerprint": lambda campaign: fingerprint(campaign, {}, runs_as_text(campaign)),
        "columns": columns,
        "known": lambda campaign: worst_beyond(campaign.study.space, known_outcomes(campaign), [stated]),
        "plan": lambda campaign: plan_study(campaign.study),
    }[name]
    peaks = []
    for runs in (FEW, MANY):
        tracemalloc.start()
        try:
            work(campaigns[runs])
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    of_a_run = (peaks[1] - peaks[0]) / (MANY - FEW)
    print(f"{name}: {of_a_run:.0f} bytes of a run, {peaks[1] / 1e6:.1f} MB of {MANY}")
    assert of_a_run < OF_A_RUN

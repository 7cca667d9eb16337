"""Campaigns: runs made once, failures as data, ask and tell, tables, results with units."""

import json
import signal

import numpy as np
import pytest

from workbench.campaign.telling import asked_csv, tell_csv
from workbench.errors import Interrupted, NotEnoughRuns, StudyError
from workbench.space.box import Parameter, Response, Space
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate, queue_design, waiting_rows
from workbench.stages.run_all import run_stage
from workbench.stages.stored_runs import screening_columns
from workbench.stages.validation import check_study
from workbench.study.loading import load_study

SPACE = Space(
    [
        Parameter("a", lower=0, upper=4, unit="N"),
        Parameter("road", kind="categorical", levels=("flat", "bump")),
    ],
    constraints=["a < 3.9 or road == 'flat'"],
)
ROWS = [
    {"a": 1.0, "road": "flat"},
    {"a": 2.0, "road": "bump"},
    {"a": 4.0, "road": "bump"},
    {"a": 3.0, "road": "flat"},
]


def model(a, road):
    if a == 3.0:
        raise ValueError("singular")
    return {"y": a + (road == "bump"), "z": 2 * a}


RESPONSES = (Response("y", "m"), Response("z"))


@pytest.fixture
def campaign(tmp_path):
    with Campaign.of(model, SPACE, responses=RESPONSES, folder=tmp_path / "c") as campaign:
        yield campaign


def test_rows_are_run_once_and_failures_are_rows(campaign, tmp_path):
    rows = campaign.evaluate(ROWS)
    assert [row.status for row in rows] == ["ok", "ok", "skipped", "failed"]
    assert rows[1].outputs == {"y": 3.0, "z": 4.0}
    assert rows[2].error == "constraint a < 3.9 or road == 'flat' is not met"
    assert rows[3].error == "ValueError: singular"
    assert campaign.failures() == {"failed": 1}
    before = [row.finished for row in campaign.runs()]
    campaign.evaluate([*ROWS, {"a": 0.5, "road": "flat"}, {"a": 0.5, "road": "flat"}])
    assert [row.finished for row in campaign.runs()][:4] == before
    assert len(campaign.runs()) == 5


def test_results_carry_units(campaign):
    campaign.evaluate(ROWS)
    data = campaign.results()
    assert data["a"].attrs["units"] == "N"
    assert data["y"].attrs["units"] == "m"
    assert data["road"].values.tolist() == ["flat", "bump", "bump", "flat"]
    np.testing.assert_array_equal(data["y"], [1.0, 3.0, np.nan, np.nan])
    table = campaign.frame()
    assert table.attrs["units"] == {"a": "N", "road": "1", "y": "m", "z": "1"}
    assert table["status"].tolist() == ["ok", "ok", "skipped", "failed"]


def test_a_continued_campaign_knows_its_runs(tmp_path):
    calls = []

    def counted(a):
        calls.append(a)
        return a

    space = Space([Parameter("a", lower=0, upper=4)])
    for count in (3, 5, 5):
        with Campaign.of(counted, space, folder=tmp_path / "c") as campaign:
            campaign.evaluate([{"a": float(k)} for k in range(count)])
    assert calls == [0, 1, 2, 3, 4]
    with Campaign.of(counted, space, folder=tmp_path / "c", version="2") as campaign:
        campaign.evaluate([{"a": 0.0}])
        assert len(campaign.runs()) == 1  # of the new version
        assert len(campaign.store.rows()) == 6


def test_failed_runs_are_tried_again_on_request(tmp_path):
    mended = False

    def moody(a):
        if not mended:
            raise ValueError("not yet")
        return a

    with Campaign.of(moody, Space([Parameter("a", lower=0, upper=4)]), folder=tmp_path / "c") as campaign:
        assert campaign.evaluate([{"a": 1.0}])[0].status == "failed"
        mended = True
        assert campaign.evaluate([{"a": 1.0}])[0].status == "failed"
        assert campaign.retry() == 1
        assert campaign.evaluate([{"a": 1.0}])[0].outputs == {"y": 1.0}


def test_ctrl_c_keeps_what_is_done(tmp_path):
    def stops(a):
        if a == 2.0:
            signal.raise_signal(signal.SIGINT)
        return a

    space = Space([Parameter("a", lower=0, upper=4)])
    with Campaign.of(stops, space, folder=tmp_path / "c") as campaign:
        with pytest.raises(
            Interrupted, match="interrupted with 2 runs unanswered; the same command continues"
        ):
            campaign.evaluate([{"a": float(k)} for k in range(4)])
        assert campaign.store.counts() == {"ok": 2, "queued": 2}
        assert [run.parameters for run in campaign.ask()] == [{"a": 2.0}, {"a": 3.0}]


def test_a_model_that_raises_what_ctrl_c_raises_has_a_failed_run(tmp_path):
    def gives_up(a):
        if a == 2.0:
            raise KeyboardInterrupt("no licence")
        return a

    with Campaign.of(gives_up, Space([Parameter("a", lower=0, upper=4)]), folder=tmp_path / "c") as campaign:
        rows = campaign.evaluate([{"a": float(k)} for k in range(4)])
    assert [row.status for row in rows] == ["ok", "ok", "failed", "ok"]
    assert rows[2].error == "KeyboardInterrupt: no licence"


def test_functions_must_take_the_parameters(tmp_path):
    with Campaign.of(lambda b: b, SPACE, folder=tmp_path / "c") as campaign:
        with pytest.raises(StudyError, match="cannot be called with the study's parameters a, road"):
            campaign.evaluate(ROWS)


STUDY = """
[study]
name = "s"
[model]
{model}
[[parameter]]
name = "a"
lower = 0
upper = 10
unit = "N"
[[parameter]]
name = "b"
lower = 0
upper = 10
[[response]]
name = "y"
unit = "m"
{more}
"""


def study(tmp_path, model, more=""):
    path = tmp_path / "s.toml"
    path.write_text(STUDY.format(model=model, more=more))
    return path


def test_ask_and_tell_through_csv(tmp_path):
    path = study(tmp_path, 'kind = "ask"', '[design]\nkind = "sobol"\nruns = 4')
    with Campaign.from_file(path) as campaign:
        document = run_stage(campaign, "design")
        assert queue_design(campaign, document) == 4
        asked = waiting_rows(campaign)
        assert len(asked) == 4
        with pytest.raises(Interrupted, match="4 runs wait for their results: `holdfast design` lists them"):
            evaluate(campaign)
        text = asked_csv(asked, campaign.study.space.names, ["y"]).splitlines()
        assert text[0] == "key,a,b,y"
        filled = [
            text[0] + ",error",
            text[1] + "1.5,",
            text[2] + ",no convergence",
            text[3] + ",",
            ",9.5,1,7.25,",
        ]
        (tmp_path / "r.csv").write_text("\n".join(filled))
        told = tell_csv(campaign, tmp_path / "r.csv")
        assert (told.answered, told.new, told.repeated, told.failed) == (2, 1, 0, 1)
        assert tell_csv(campaign, tmp_path / "r.csv").repeated == 3
        rows = campaign.runs()
        assert [row.status for row in rows] == ["ok", "failed", "queued", "queued", "ok"]
        assert rows[1].error == "no convergence"
        assert rows[4].inputs == {"a": 9.5, "b": 1.0}
        assert screening_columns(campaign, {}).keys == [rows[0].key, rows[1].key, rows[4].key]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", "r.csv has no column 'y'; it has a, b"),
        ("a,y\n1,2\n", "has no column 'b'"),
        ("a,b,y\n1,2,x\n", "r.csv, line 2: column 'y' needs a number, got 'x'. Leave all responses empty"),
        (
            "a,b,y\n1,2,3.5 MPa\n",
            r"column 'y' needs a number, got '3.5 MPa'. Write the number alone, 3.5; the",
        ),
        ("a,b,y\n1,2\n", "line 2: 2 cells where the header has 3"),
        ("key,y\nabc,2\n", "line 2: no run 'abc' was asked for"),
        ("a,b,y\n1,99,2\n", "line 2: parameter 'b' lies between 0 and 10, got 99"),
        ("a,b,y\n1,2,3\n1,99,2\n", "line 3: parameter 'b' lies between"),
    ],
)
def test_what_tell_refuses_leaves_nothing_behind(tmp_path, text, words):
    path = study(tmp_path, 'kind = "ask"')
    (tmp_path / "r.csv").write_text(text)
    with Campaign.from_file(path) as campaign:
        with pytest.raises(StudyError, match=words):
            tell_csv(campaign, tmp_path / "r.csv")
        with pytest.raises(StudyError, match=r"no table .*nope.csv; give the path of a CSV$"):
            tell_csv(campaign, tmp_path / "nope.csv")
        assert campaign.runs() == []


def test_tell_from_python(tmp_path):
    path = study(tmp_path, 'kind = "ask"')
    with Campaign.from_file(path) as campaign:
        (key,) = campaign.enqueue([{"a": 1, "b": 2}], batch="design")
        assert campaign.tell(key, 3.0) == key
        campaign.tell(key, 4.0)  # late: the first answer stays
        campaign.tell(None, {"y": float("inf")}, parameters={"a": 2, "b": 2})
        campaign.tell(None, failure="broke", parameters={"a": 3, "b": 2})
        assert [(r.status, dict(r.outputs)) for r in campaign.runs()] == [
            ("ok", {"y": 3.0}),
            ("nonfinite", {}),
            ("failed", {}),
        ]
        with pytest.raises(StudyError, match="no run 'x' was asked for"):
            campaign.tell("x", 3.0)
        with pytest.raises(StudyError, match="needs the key of an asked run, or the parameters"):
            campaign.tell(None, 3.0)
        with pytest.raises(StudyError, match="needs outputs, or the failure"):
            campaign.tell(key)


def test_a_table_is_a_campaign_of_runs_made_elsewhere(tmp_path):
    (tmp_path / "runs.csv").write_text("a,b,y\n1,2,3\n2,2,4.5\n0.30000000000000004,2,5\n7,1,2\n")
    path = study(tmp_path, 'kind = "table"\nfile = "runs.csv"')
    with Campaign.from_file(path) as campaign:
        assert run_stage(campaign, "design")["n"] == 4
        assert evaluate(campaign)["counts"] == {"ok": 4}
        assert campaign.runs()[2].inputs["a"] == 0.30000000000000004
    check_study(campaign.study)


def test_failed_runs_of_a_table_are_runs(tmp_path):
    rows = [f"{k},{(k * k) % 7},{0.1 * k * k}" for k in range(8)]
    rows[2], rows[5] = "2,4,", "5,4,nan"
    (tmp_path / "runs.csv").write_text("\n".join(["a,b,y", *rows]))
    path = study(
        tmp_path,
        'kind = "table"\nfile = "runs.csv"',
        '[screen]\nresponse = "y"\n[worst_case]\nresponse = "y"',
    )
    with Campaign.from_file(path) as campaign:
        found = campaign.run()
        assert found["evaluate"]["counts"] == {"ok": 6, "failed": 1, "nonfinite": 1}
        assert campaign.failures() == found["failures"] == {"failed": 1, "nonfinite": 1}
        assert campaign.runs()[2].error == "runs.csv has no value of y for this run"
        assert (found["screen"]["n_runs"], found["screen"]["n_left_out"]) == (6, 2)
        assert found["worst_case"]["failures"] == {"failed": 1, "nonfinite": 1}
    check_study(campaign.study)


def test_tables_that_do_not_fit(tmp_path):
    (tmp_path / "runs.csv").write_text("a,b,y\n1,2,3\n2,2,4.5\n3,2,5\n")
    path = study(tmp_path, 'kind = "table"\nfile = "runs.csv"', '[design]\nkind = "table"\nruns = 9')
    with Campaign.from_file(path) as campaign:
        with pytest.raises(StudyError, match=r"runs = 9, but the table runs.csv offers 3 rows"):
            run_stage(campaign, "design")
        with pytest.raises(StudyError, match="offers 3 rows"):
            check_study(campaign.study)
    path = study(tmp_path, 'kind = "table"\nfile = "runs.csv"', '[design]\nkind = "ihs"\nruns = 2')
    with Campaign.from_file(path) as campaign, pytest.raises(StudyError, match="a table has its runs"):
        run_stage(campaign, "design")
    with pytest.raises(StudyError, match=r"line \d+: design kind 'ihs' needs a model that can be run"):
        check_study(load_study(path))
    (tmp_path / "runs.csv").write_text("a,b,y\n1,2,3\n2,2,4.5\n30,2,5\n")
    path = study(tmp_path, 'kind = "table"\nfile = "runs.csv"')
    with Campaign.from_file(path) as campaign:
        with pytest.raises(
            StudyError,
            match=r"runs.csv, row 3 below the header: parameter 'a' lies between 0 and 10 N, got 30",
        ):
            run_stage(campaign, "design")
        with pytest.raises(
            StudyError, match=r"line \d+: runs.csv, row 3 below the header: .*got 30. Mend it"
        ):
            check_study(campaign.study)


def test_points_of_a_design_may_come_from_a_file(tmp_path):
    (tmp_path / "points.csv").write_text("b,a\n1,2\n2,2\n3,4\n")
    path = study(tmp_path, 'kind = "ask"', '[design]\nkind = "table"\nfile = "points.csv"\nruns = 2')
    with Campaign.from_file(path) as campaign:
        assert run_stage(campaign, "design")["physical"] == [[2.0, 1.0], [2.0, 2.0]]
    path = study(tmp_path, 'kind = "ask"', '[design]\nkind = "table"')
    with pytest.raises(StudyError, match="needs file, a CSV"):
        Campaign.from_file(path)


def test_the_design_is_made_once(tmp_path):
    path = study(tmp_path, 'kind = "ask"', '[design]\nkind = "sobol"\nruns = 4')
    with Campaign.from_file(path) as campaign:
        first = run_stage(campaign, "design")
        again = run_stage(campaign, "design")
        assert json.dumps(first, sort_keys=True) == json.dumps(again, sort_keys=True)
    study(tmp_path, 'kind = "ask"', '[design]\nkind = "sobol"\nruns = 5')
    with Campaign.from_file(path) as campaign:
        assert run_stage(campaign, "design")["n"] == 5
        assert campaign.study.text == (campaign.folder / "study.toml").read_text()


def test_stages_refuse_what_they_cannot_use(tmp_path):
    path = study(tmp_path, 'kind = "ask"', '[screen]\nresponse = "y"')
    with Campaign.from_file(path) as campaign:
        with pytest.raises(StudyError, match="there is no design to evaluate"):
            evaluate(campaign)
        with pytest.raises(
            NotEnoughRuns, match="0 of 0 runs gave a value, 3 are needed: nothing has been run yet"
        ):
            run_stage(campaign, "screen")
        with pytest.raises(StudyError, match=r"the study has no \[worst_case\] table"):
            run_stage(campaign, "worst_case")
        for k in range(4):
            campaign.tell(None, 5.0, parameters={"a": k, "b": 1})
        with pytest.raises(
            StudyError, match=r"response 'y' is 5 in all 4 runs; there is nothing to explain\. Take"
        ):
            run_stage(campaign, "screen")


def test_a_changed_model_is_not_mixed_with_its_old_runs(tmp_path):
    (tmp_path / "m.py").write_text("def f(a, b): return a + b")
    path = study(tmp_path, 'kind = "python"\nfunction = "m.py:f"')
    with Campaign.from_file(path) as campaign:
        campaign.evaluate([{"a": 1, "b": 2}])
    (tmp_path / "m.py").write_text("def f(a, b): return a - b")
    with pytest.raises(
        StudyError, match=r"the source of the model changed after 1 run was stored in s.holdfast"
    ):
        Campaign.from_file(path)
    with Campaign.from_file(path, keep_runs=True) as campaign:
        assert campaign.evaluate([{"a": 1, "b": 2}])[0].outputs == {"y": 3.0}
    study(tmp_path, 'kind = "python"\nfunction = "m.py:f"\nversion = "2"')
    with Campaign.from_file(path) as campaign:
        assert campaign.evaluate([{"a": 1, "b": 2}])[0].outputs == {"y": -1.0}
        assert len(campaign.runs()) == 1


def test_workers_keep_failures_apart(tmp_path):
    (tmp_path / "m.py").write_text(
        "import os, signal, time\n"
        "def f(a, b):\n"
        "    print('at', a)\n"
        "    if a == 1: os.kill(os.getpid(), signal.SIGSEGV)\n"
        "    if a == 2: time.sleep(60)\n"
        "    if a == 3: os._exit(7)\n"
        "    if a == 4: raise ValueError('no')\n"
        "    if a == 5: return float('inf')\n"
        "    return a + b\n"
    )
    path = study(tmp_path, 'kind = "python"\nfunction = "m.py:f"', "[evaluate]\nworkers = 2\ntimeout = 0.4")
    with Campaign.from_file(path) as campaign:
        rows = campaign.evaluate([{"a": float(k), "b": 0.5} for k in range(8)])
    statuses = ["ok", "killed", "timeout", "killed", "failed", "nonfinite", "ok", "ok"]
    assert [row.status for row in rows] == statuses
    assert rows[1].error == "the worker process was ended by signal 11 (SIGSEGV)"
    assert rows[1].attempt == 2  # a row that ends its process is tried once more
    assert rows[2].error == "no answer within 0.4 s"
    assert rows[3].error == "the worker process ended by itself with exit code 7"
    assert rows[4].log.endswith("at 4.0")
    assert rows[7].outputs == {"y": 7.5}


def test_models_that_cannot_be_opened_say_so(tmp_path):
    (tmp_path / "m.py").write_text("import os\nos._exit(3)")
    path = study(tmp_path, 'kind = "python"\nfunction = "m.py:f"')
    with Campaign.from_file(path) as campaign:
        with pytest.raises(
            StudyError, match="process ended while it was opened: ended by itself with exit code 3"
        ):
            campaign.evaluate([{"a": 1, "b": 2}])
    (tmp_path / "m.py").write_text("def g(a, b): return a")
    with Campaign.from_file(path, keep_runs=True) as campaign:
        with pytest.raises(StudyError, match=r"m.py has no 'f'"):
            campaign.evaluate([{"a": 1, "b": 2}])
    path = study(tmp_path, 'kind = "python"\nfunction = "m.py:f"', "[design]\nruns = 5")
    with pytest.raises(StudyError, match=r"m.py has no 'f'"):
        check_study(load_study(path))

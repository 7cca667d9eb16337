"""Robust comparison, layout, failures, watching and exports of a campaign."""

import json

import pytest

from workbench.campaign.results.failures import failure_document, failure_lines, where_runs_fail
from workbench.errors import StoreError, StudyError
from workbench.report.lines.robust import robust_lines
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.planning import plan_study
from workbench.stages.run_all import run_stage
from workbench.stages.validation import check_study
from workbench.system.atomic import read_json
from workbench.terminal.watching import (
    page,
    state,
    state_lines,
    write_page,
)

STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "k"
lower = 1
upper = 4
unit = "N/m"
[[parameter]]
name = "u"
lower = 0
upper = 1
{baseline}
[[response]]
name = "y"
unit = "mm"
[evaluate]
engine = "inline"
{more}
"""
ROBUST = """
[robust]
response = "y"
samples = 40
limit = 0.6
[[robust.design]]
name = "soft"
values = { k = 1.0 }
[[robust.design]]
name = "stiff"
values = { k = 2.0 }
"""


def open_study(folder, more="", code="def f(k, u): return u / k", *, baseline=""):
    (folder / "m.py").write_text(code)
    (folder / "s.toml").write_text(STUDY.format(more=more, baseline=baseline))
    return Campaign.from_file(folder / "s.toml")


def test_designs_are_compared_at_the_same_points(tmp_path):
    with open_study(tmp_path, ROBUST) as campaign:
        document = run_stage(campaign, "robust")
        assert document == read_json(campaign.folder / "robust.json")
        assert len(campaign.runs()) == 80
        soft, stiff = document["summaries"]
        assert soft["mean"] == pytest.approx(0.5, abs=0.01)  # uniform u, Latin hypercube of 40
        assert stiff["mean"] == pytest.approx(soft["mean"] / 2)
        assert soft["beyond_limit"][0] == pytest.approx(0.4, abs=0.03)
        assert {row.batch for row in campaign.runs()} == {"robust"}
        before = [row.finished for row in campaign.runs()]
        assert run_stage(campaign, "robust") == document
        assert [row.finished for row in campaign.runs()] == before


def test_designs_are_screened_on_the_same_points(tmp_path):
    code = "def f(k, u, w): return u / k + max(k - 1.5, 0) * 4 * w"
    more = '[[parameter]]\nname = "w"\nlower = 0\nupper = 1\n' + ROBUST.replace(
        "samples = 40", "samples = 40\nscreened = 30"
    )
    with open_study(tmp_path, more, code) as campaign:
        soft, stiff = run_stage(campaign, "robust")["screenings"]
    assert soft["runs"] == stiff["runs"] == 30
    assert soft["selected"] == ["u"]
    assert stiff["selected"][0] == "w"
    assert stiff["appeared"] == ["w"]


def test_no_more_is_screened_than_is_run(tmp_path):
    text = ROBUST.replace("samples = 40", "samples = 40\nscreened = 41")
    with pytest.raises(StudyError, match=r"line 26: \[robust\] screened needs at most samples=40, got 41"):
        open_study(tmp_path, text)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("{ k = 2.0 }", "{ u = 0.5 }", "design 'soft' lacks 'u'; every design sets the same parameters"),
        ("{ k = 1.0 }", "{ k = 1.0, z = 1.0 }", "design 'soft' names 'z', which is no parameter"),
        ("{ k = 2.0 }", "{ k = 9.0 }", "line 30: .* design 'stiff': parameter 'k' lies .* 4 N/m, got 9"),
        ('"stiff"', '"soft"', "line 30: .* design 'soft' is given twice; every name may stand once"),
    ],
)
def test_robust_designs_that_do_not_fit(tmp_path, old, new, words):
    with pytest.raises(StudyError, match=words):
        open_study(tmp_path, ROBUST.replace(old, new))


def test_a_study_that_only_compares_designs_is_valid(tmp_path):
    with open_study(tmp_path, ROBUST) as campaign:
        assert check_study(campaign.study)["summary"].endswith("stages robust")
    with (
        open_study(tmp_path) as campaign,
        pytest.raises(StudyError, match=r"no \[design\] table, so there is nothing to run; add one"),
    ):
        check_study(campaign.study)


def test_nothing_uncertain_and_nothing_to_run(tmp_path):
    text = ROBUST.replace("{ k = 1.0 }", "{ k = 1.0, u = 0.5 }").replace(
        "{ k = 2.0 }", "{ k = 2.0, u = 0.5 }"
    )
    with pytest.raises(StudyError, match=r"line 23: .*so nothing is uncertain"):
        open_study(tmp_path, text)
    with open_study(tmp_path) as campaign:
        with pytest.raises(StudyError, match=r"the study has no \[robust\] table"):
            run_stage(campaign, "robust")
        with pytest.raises(StudyError, match=r"the study has no \[layout\] table"):
            run_stage(campaign, "layout")


@pytest.mark.parametrize(
    ("nominal", "baseline", "expected"),
    [
        ("nominal = { u = 0.5 }", "", {"u": 0.5}),
        ("", "baseline = 0.25", {"u": 0.25}),
        ("nominal = { u = 0.5 }", "baseline = 0.25", {"u": 0.5}),
        ("", "", None),
    ],
)
def test_the_price_of_robustness_is_read_at_the_nominal_scenario(tmp_path, nominal, baseline, expected):
    more = ROBUST.replace("limit = 0.6", f"limit = 0.6\n{nominal}")
    with open_study(tmp_path, more, baseline=baseline) as campaign:
        document = run_stage(campaign, "robust")
        planned = plan_study(campaign.study)["runs"]["robust"]
        assert len(campaign.runs()) == planned == (80 if expected is None else 82)
    soft, stiff = document["summaries"]
    assert document["nominal"] == expected
    if expected is None:
        assert soft["price_of_robustness"] is None
        assert not any("nominal" in line for line in robust_lines(document))
    else:
        u = expected["u"]
        assert (soft["nominal"], stiff["nominal"]) == (u, u / 2)
        assert (soft["price_of_robustness"], stiff["price_of_robustness"]) == (u / 2, 0)
        line = f"at nominal (price of robustness): soft {u} ({u / 2}), stiff {u / 2} (0)"
        assert line in robust_lines(document)


@pytest.mark.parametrize(
    ("nominal", "words"),
    [
        (
            "{ w = 0.5 }",
            r"line 27: \[robust\] nominal names 'w', which is no parameter; the uncertain",
        ),
        ("{ u = 0.5, k = 2.0 }", "nominal names 'k', which the designs set; the uncertain parameters are u"),
        (
            "{ u = 7.0 }",
            r"\[robust\] the nominal scenario is not in the uncertainty: parameter 'u' lies between",
        ),
        ("{ u = nan }", "robust.nominal.u needs a finite number, got nan"),
        ("0.5", "robust.nominal needs a table such as { name = value }, got 0.5"),
        ("{}", "robust.nominal needs at least 1 entry, got {}"),
    ],
)
def test_a_nominal_scenario_that_does_not_fit_is_refused(tmp_path, nominal, words):
    with pytest.raises(StudyError, match=words):
        open_study(tmp_path, ROBUST.replace("limit = 0.6", f"limit = 0.6\nnominal = {nominal}"))


def test_a_nominal_scenario_without_a_value_is_refused(tmp_path):
    more = '[[parameter]]\nname = "w"\nlower = 0\nupper = 1\n'
    more += ROBUST.replace("limit = 0.6", "nominal = { w = 0.5 }")
    with pytest.raises(StudyError, match=r"nominal lacks 'u', which has no baseline; give it a value"):
        open_study(tmp_path, more)


def test_baselines_outside_the_uncertainty_leave_the_price_out_and_say_so(tmp_path):
    (tmp_path / "m.py").write_text("def f(k, u): return u / k")
    text = 'constraint = ["u <= 0.8"]' + STUDY.format(more=ROBUST, baseline="baseline = 0.9")
    (tmp_path / "s.toml").write_text(text)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        document = run_stage(campaign, "robust")
    assert document["nominal"] is None
    assert document["warnings"][-1].startswith(
        "no price of robustness from the baselines: the nominal scenario breaks the constraint 'u <= 0.8'"
    )


def test_a_layout_is_a_stage(tmp_path):
    more = '[layout]\nproblem = "studies.trusses:cantilever"\nevaluations = 6\npurified = false\n'
    with open_study(tmp_path, more) as campaign:
        document = run_stage(campaign, "layout")
        assert document["value"] <= document["start_value"]
        assert read_json(campaign.folder / "layout.json")["evaluations"] == document["evaluations"] <= 6
    more = more.replace("evaluations = 6", "scenarios = true")
    with (
        open_study(tmp_path, more) as campaign,
        pytest.raises(StudyError, match="scenarios = true needs a worst case"),
    ):
        run_stage(campaign, "layout")


FAILS = "def f(k, u):\n    if k > 3: raise ValueError('no equilibrium')\n    return u / k"


def test_failures_say_where_they_sit(tmp_path):
    with open_study(tmp_path, code=FAILS) as campaign:
        campaign.evaluate([{"k": 1 + 3 * i / 19, "u": (7 * i % 20) / 20} for i in range(20)])
        runs = campaign.runs()
        cuts = where_runs_fail(runs, campaign.study.space)
        assert (cuts[0].parameter, cuts[0].side, cuts[0].score) == ("k", "above", 1.0)
        assert 2.8 < cuts[0].threshold < 3.1
        assert cuts[1].score < 0.6
        document = failure_document(runs, campaign.study.space)
        json.dumps(document)
        assert document["errors"] == {"ValueError: no equilibrium": 7}
        text = "\n".join(failure_lines(document))
        assert "7 runs without a value of 20" in text
        assert "N/m: 7 of 7 failures, 0 of 13 good runs" in text
        assert failure_lines(
            failure_document([r for r in runs if r.status == "ok"], campaign.study.space)
        ) == ["no run failed"]


def test_words_are_cut_by_level(tmp_path):
    space = Space(
        [
            Parameter("road", kind="categorical", levels=("flat", "bump", "ditch")),
            Parameter("n", kind="binary"),
        ]
    )

    def f(road, n):
        return 1 / 0 if road == "ditch" else 1.0

    rows = [{"road": road, "n": n} for road in ("flat", "bump", "ditch") for n in (0, 1)]
    with Campaign.of(f, space, folder=tmp_path / "c") as campaign:
        campaign.evaluate(rows)
        assert where_runs_fail(campaign.runs(), space) == []  # two failures name no place
    space3 = Space([*space.parameters, Parameter("a", lower=0, upper=1)])

    def g(road, n, a):
        return f(road, n)

    with Campaign.of(g, space3, folder=tmp_path / "d") as campaign:
        campaign.evaluate([{**row, "a": a} for row in rows for a in (0.0, 1.0)])
        (cut, *_) = where_runs_fail(campaign.runs(), space3)
        assert cut.text("1") == "road is ditch: 4 of 4 failures, 0 of 8 good runs"


def test_a_campaign_is_watched_from_outside(tmp_path):
    with open_study(tmp_path, code=FAILS) as campaign:
        campaign.evaluate([{"k": 1.0, "u": 0.5}, {"k": 2.0, "u": 0.5}, {"k": 4.0, "u": 0.5}])
        campaign.enqueue([{"k": 2.5, "u": 0.5}], batch="design")
        found = state(campaign.folder)
        assert found["counts"] == {"queued": 1, "ok": 2, "failed": 1}
        assert (found["done"], found["left"]) == (3, 1)
        assert found["extremes"] == {"y": (0.25, 0.5)}
        assert found["seconds_left"] == pytest.approx(20.0)  # three runs in the last minute
        text = state_lines(found)
        assert any("failed: ValueError: no equilibrium" in line for line in text)
        assert max(map(len, text[1:])) <= 80
        write_page(tmp_path / "watch.html", found, every=5)
        html = (tmp_path / "watch.html").read_text()
        assert 'http-equiv="refresh" content="5"' in html
        assert "<script" not in html
    assert "&lt;b&gt;" in page(
        {**found, "failures": [{"key": "k" * 12, "status": "failed", "error": "<b>"}]}, every=1
    )
    with pytest.raises(StoreError, match="no database"):
        state(tmp_path)


def test_exports_are_whole_files(tmp_path):
    import xarray as xr

    from workbench.campaign.results.exports import write_all

    with open_study(tmp_path, code=FAILS) as campaign:
        campaign.evaluate([{"k": 1.0, "u": 1 / 3}, {"k": 4.0, "u": 0.5}])
        paths = write_all(campaign)
        first = [p.read_bytes() for p in paths]
        assert [p.read_bytes() for p in write_all(campaign)] == first
        assert paths[0].read_text().splitlines()[1].split(",")[3:6] == ["1.0", repr(1 / 3), repr(1 / 3)]
        with xr.open_dataset(paths[1], engine="scipy") as data:
            assert float(data["y"][0]) == 1 / 3
            assert data["k"].attrs["units"] == "N/m"
            assert [str(s) for s in data["status"].values.astype(str)] == ["ok", "failed"]

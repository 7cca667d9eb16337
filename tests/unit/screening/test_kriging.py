"""Screening with names: rows in, a document out."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

import doe
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import Outcome
from workbench.screening.kriging import screen
from workbench.space.box import Space
from workbench.space.parameter import Distribution, Parameter, Response

SPACE = Space(
    [
        Parameter("k", lower=1e3, upper=5e3, unit="N/m"),
        Parameter("c", lower=0, upper=20, unit="N*s/m"),
        Parameter("hands", kind="binary"),
        Parameter("belt", kind="categorical", levels=("none", "lap", "full")),
        Parameter("seat", lower=-10, upper=10, unit="mm"),
    ]
)


def model(row):
    return {"none": 0.0, "lap": 4.0, "full": 1.0}[row["belt"]] + np.sin(row["k"] / 800) + 2 * row["hands"]


def runs(n=48, seed=0):
    points = np.random.default_rng(seed).random((n, 5))
    return [
        Outcome(parameters=row, status="ok", outputs={"head": float(model(row))}, key=f"r{i}")
        for i, row in enumerate(SPACE.rows(points))
    ]


@pytest.fixture(scope="module")
def found():
    rows = runs()
    rows[5] = Outcome(parameters=rows[5].parameters, status="failed", key="r5", error="crash")
    return screen(rows, SPACE, Response("head", unit="mm"), seed=3)


def test_selects_by_name_and_counts_failures(found):
    assert set(found.selected) == {"k", "hands", "belt"}
    assert set(found.ranking) == set(SPACE.names)
    assert (found.n_runs, found.n_left_out, found.unit) == (47, 1, "mm")
    assert all(found.stability[name] > 0.8 for name in found.selected)


def test_document_is_json_with_everything_the_report_reads(found):
    document = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert re.fullmatch(
        r"restricted log-likelihood l of \(3\.13\), constant 0, larger is better "
        r"\(the response itself leaves \S+ % of left-out runs unexplained\)",
        document["criterion"],
    )
    step = document["path"][0]
    assert {
        "step",
        "selected",
        "added",
        "theta_common",
        "sigma2",
        "log_likelihood",
        "gain",
        "accepted",
    } <= set(step)
    left = document["leave_one_out"]
    assert len(left["run_ids"]) == len(left["predicted"]) == 47
    assert "r5" not in left["run_ids"]
    assert left["q2"] > 0.8
    assert document["main_effects"]["belt"]["x"] == ["none", "lap", "full"]
    assert min(document["main_effects"]["k"]["x"]) == pytest.approx(1e3)
    total = document["sobol"]["total"]
    assert set(total) == set(found.selected)
    assert max(total, key=total.get) == "belt"
    assert document["kriging"]["theta"].keys() == total.keys()
    assert document["kriging"]["interval_factor"] > 0.0
    assert document["diagnosis"]["resolved"] is True


def test_tables_and_mappings_give_the_same(found):
    rows = [{**r.parameters, "head": r.outputs["head"]} for r in runs()]
    rows[5]["head"] = float("nan")
    for table in (rows, pd.DataFrame(rows), pd.DataFrame(rows).rename_axis("run").to_xarray()):
        other = screen(table, SPACE, "head", seed=3, effects=False)
        assert other.selected == found.selected
        assert other.n_left_out == 1
        assert other.path[-1]["log_likelihood"] == pytest.approx(found.path[-1]["log_likelihood"])
    assert other.to_frame().loc[1, "selected"] == found.path[0]["selected"][0]


def test_order_of_runs_and_seed_do_not_matter_much(found):
    rows = runs()
    rows[5] = replace(rows[5], status="timeout", outputs={})
    again = screen(rows[::-1], SPACE, Response("head", unit="mm"), seed=3, effects=False)
    assert again.selected == found.selected
    assert again.path[0]["log_likelihood"] == found.path[0]["log_likelihood"]


def test_nothing_selected_is_said():
    noise = np.random.default_rng(2).standard_normal(30)
    rows = [replace(r, outputs={"head": float(e)}) for r, e in zip(runs(30), noise, strict=True)]
    assert screen(rows, SPACE, "head", effects=False).verdict.startswith("not resolved")
    rows = [replace(r, outputs={"head": 7.0}) for r in runs(30)]
    empty = screen(rows, SPACE, "head")
    assert empty.selected == ()
    assert empty.verdict == "nothing to screen: the response is constant"
    assert empty.leave_one_out == {}
    assert empty.kriging == {}
    json.dumps(empty.to_dict(), allow_nan=False)


@pytest.mark.parametrize("n", [4, 5, 6, 8])
def test_hardly_any_runs_are_screened_without_a_warning(n):
    for seed in range(3):
        assert not screen(runs(n, seed), SPACE, "head", effects=False).diagnosis["resolved"]


def test_groups_and_number_by_name():
    fixed = screen(runs(), SPACE, "head", n_selected=1, effects=False)
    assert len(fixed.selected) == 1
    together = screen(runs(), SPACE, "head", groups=[("k", "seat")], effects=False)
    assert {"k", "seat"} <= set(together.selected)


def test_bad_input_is_refused_with_a_cure():
    with pytest.raises(StudyError, match=r"screening method needs one of default, .* got 'magic'"):
        screen(runs(), SPACE, "head", method="magic")
    with pytest.raises(
        NotEnoughRuns, match=r"screening 'head' needs at least 3 runs with a value, got 2 of 3"
    ):
        screen([*runs(2), Outcome(parameters={}, status="failed")], SPACE, "head")
    with pytest.raises(StudyError, match=r"run r0 has no response 'neck'; it has \['head'\]"):
        screen(runs(), SPACE, "neck")
    with pytest.raises(StudyError, match=r"the table of runs has no column 'k'"):
        screen(pd.DataFrame({"head": [1.0]}), SPACE, "head")
    with pytest.raises(StudyError, match=r"run 0 has no 'k'; it has \['head'\]"):
        screen([{"head": 1.0}], SPACE, "head")
    with pytest.raises(StudyError, match=r"groups name parameter 'mass', which the study does not have"):
        screen(runs(), SPACE, "head", groups=[("k", "mass")])
    with pytest.raises(
        StudyError, match=r"groups name parameter 'k' twice; a parameter belongs to one group"
    ):
        screen(runs(), SPACE, "head", groups=[("k", "c"), ("k", "seat")])
    for number in (0, 5):
        message = rf"n_selected needs a number from 1 to 4 \(a group counts as one\), got {number}"
        with pytest.raises(StudyError, match=message):
            screen(runs(), SPACE, "head", groups=[("k", "c")], n_selected=number)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("k", np.nan, r"run 7: parameter 'k' lies between .*, got nan\. Correct it, or leave the run out"),
        ("k", 9e9, r"run 7: parameter 'k' lies between .*, got 9e\+09\. Correct it"),
        ("seat", "far", r"run 7: parameter 'seat' needs numbers, got 'far'\. Correct it"),
        ("belt", None, r"run 7: parameter 'belt' takes \['none', 'lap', 'full'\], got None\. Correct it"),
        (
            "head",
            "crash",
            r"run 7 has 'crash' where a number of 'head' should be: leave the run out, or give",
        ),
    ],
)
def test_the_run_that_holds_no_number_is_named(name, value, message):
    rows = [{**run.parameters, "head": run.outputs["head"]} for run in runs()]
    rows[7] = {**rows[7], name: value}
    for given in (rows, pd.DataFrame(rows)):
        with pytest.raises(StudyError, match=message.replace("None", "(None|nan)")):
            screen(given, SPACE, "head", effects=False)
    if name != "head":
        outcomes = [Outcome(parameters=row, status="ok", outputs={"head": row["head"]}) for row in rows]
        with pytest.raises(StudyError, match=message):
            screen(outcomes, SPACE, "head", effects=False)


def test_a_missing_response_is_counted():
    frame = pd.DataFrame([{**run.parameters, "head": run.outputs["head"]} for run in runs()])
    frame["head"] = frame["head"].astype(object)
    frame.loc[[3, 4, 5], "head"] = [None, pd.NA, "nan"]
    assert screen(frame, SPACE, "head", effects=False).n_left_out == 3


@pytest.mark.slow
def test_by_ranks_any_rising_scale_of_the_response_selects_the_same():
    rows = runs()
    stretched = [replace(o, outputs={"head": float(np.exp(o.outputs["head"]))}) for o in rows]
    plain, other = (screen(r, SPACE, "head", transform="ranks", seed=3) for r in (rows, stretched))
    assert plain.selected == other.selected
    assert plain.theta == other.theta
    assert "of the ranks of the response" in plain.criterion
    assert plain.kriging["sigma2"] != other.kriging["sigma2"]  # the Kriging is of the response itself


def test_an_unknown_transform_is_refused():
    with pytest.raises(
        StudyError,
        match=r"screening transform needs one of none, auto, log, ranks, box-cox, yeo-johnson, got",
    ):
        screen(runs(), SPACE, "head", transform="sqrt")


def test_shares_are_averaged_over_the_law_of_each_parameter():
    """Variances 1/12, 1/4, 1/6 and 2/9 of the parts; uniform integers would have 1/3 of a variance of one."""
    space = Space(
        [
            Parameter("p", lower=0, upper=1),
            Parameter("b", kind="binary"),
            Parameter("k", kind="integer", lower=1, upper=3),
            Parameter("m", kind="categorical", levels=("a", "b", "c")),
        ]
    )
    rows = space.rows(np.random.default_rng(0).random((60, 4)))
    rows = [{**r, "y": r["p"] + r["b"] + 0.5 * r["k"] + (r["m"] == "a")} for r in rows]
    found = screen(rows, space, "y")
    parts = {"p": 1 / 12, "b": 1 / 4, "k": 1 / 6, "m": 2 / 9}
    for name, part in parts.items():
        assert found.sobol["main"][name] == pytest.approx(part / sum(parts.values()), abs=0.01)
    assert found.main_effects["k"]["x"] == [1, 2, 3]
    assert found.main_effects["b"]["x"] == [0, 1]
    assert found.sobol["averaged_over"]["k"] == "its 3 levels, equally likely"


def test_shares_follow_a_distribution_and_a_log_scale():
    law = Distribution("norm", {"loc": 3.0, "scale": 1.0})
    space = Space(
        [
            Parameter("n", distribution=law),
            Parameter("u", lower=0, upper=6),
            Parameter("g", lower=1.0, upper=100.0, scale="log"),
        ]
    )
    rows = space.rows(np.random.default_rng(1).random((50, 3)))
    # each part has variance 3, but for the tails of the normal law beyond its bounds
    rows = [{**r, "y": 3**0.5 * r["n"] + r["u"] + 3 * np.log10(r["g"])} for r in rows]
    found = screen(rows, space, "y")
    kept = stats.truncnorm(*stats.norm.ppf([1e-3, 1 - 1e-3])).var()
    for name, part in {"n": kept, "u": 1.0, "g": 1.0}.items():
        assert found.sobol["main"][name] == pytest.approx(part / (2 + kept), abs=0.01)
    assert found.sobol["averaged_over"] == {
        "n": "norm(loc = 3, scale = 1) between the bounds",
        "u": "uniform between the bounds",
        "g": "uniform between the bounds, on a log scale",
    }


def test_curves_over_many_levels_stand_at_levels():
    space = Space([Parameter("grip", lower=350, upper=700, step=7), Parameter("c", lower=0, upper=1)])
    rows = space.rows(np.random.default_rng(2).random((40, 2)))
    found = screen([{**r, "y": r["grip"] * (1 + r["c"])} for r in rows], space, "y")
    effect = found.main_effects["grip"]
    assert len(effect["x"]) == 25
    assert set(effect["x"]) <= {350.0 + 7 * i for i in range(51)}
    assert effect["mean"] == pytest.approx([1.5 * x for x in effect["x"]], rel=1e-3)


def test_auto_takes_the_logarithm_of_a_response_over_decades_and_says_why():
    rows = [
        replace(r, outputs={"head": float(np.exp(2.0 * r.outputs["head"]))}) for r in runs(40) if r.outputs
    ]
    auto, log = (screen(rows, SPACE, "head", transform=t, effects=False) for t in (None, "log"))
    assert auto.selected == log.selected
    assert ", of the logarithm of the response (left unexplained of left-out runs" in auto.criterion
    low = [replace(r, outputs={"head": r.outputs["head"] - 1e3}) for r in rows]
    with pytest.raises(StudyError, match="'log' needs 'head' above 0 in all runs, got -"):
        screen(low, SPACE, "head", transform="log", effects=False)


def test_a_response_over_decades_that_is_screened_as_it_is_is_told_of_other_scales():
    rows = [
        replace(r, outputs={"head": float(np.exp(3.0 * r.outputs["head"]))}) for r in runs(40) if r.outputs
    ]
    values = np.array([r.outputs["head"] for r in rows])
    advised = (
        f'head spans {np.log10(values.max() / values.min()):.2g} decades: transform = "auto" in [screen]'
    )
    plain, logged = (screen(rows, SPACE, "head", transform=t, effects=False) for t in ("none", "log"))
    assert advised in plain.advice
    assert "decades" not in logged.advice
    offset = [replace(r, outputs={"head": r.outputs["head"] + values.max()}) for r in rows]
    assert "decades" not in screen(offset, SPACE, "head", effects=False).advice


@pytest.mark.slow
def test_what_predicts_is_on_the_scale_screened_on_and_in_the_unit_of_the_response():
    space = Space([Parameter(name, lower=0.0, upper=1.0) for name in "abc"])
    points = np.random.default_rng(3).random((30, 3))
    true = np.exp(6 * points[:, 0] + np.sin(5 * points[:, 1]))
    rows = [{**row, "f": float(y)} for row, y in zip(space.rows(points), true, strict=True)]
    plain, logged, ranked = (screen(rows, space, "f", transform=t) for t in ("none", "log", "ranks"))
    assert logged.kriging["scale"] == "log"
    assert (plain.kriging["scale"], ranked.kriging["scale"]) == ("none", "none")
    left = logged.leave_one_out
    np.testing.assert_allclose(left["observed"], true)
    assert 1.0 - left["q2"] < 0.5 * (1.0 - plain.leave_one_out["q2"])
    assert np.min(left["predicted"]) > 0.0 > np.min(plain.leave_one_out["predicted"])
    assert (left["std"] > 0.0).all()
    # effects stay those of the response
    assert logged.main_effects["a"]["mean"][-1] > 100.0


def test_effects_and_shares_are_those_of_what_predicts():
    space = Space([Parameter(name, lower=0, upper=1) for name in ("a", "b", "c")])
    x = doe.optimised_lhs(30, 3, swaps=5000, rng=np.random.default_rng(4))
    y = np.exp(5 * x[:, 0] + 2 * x[:, 1])
    rows = [{**row, "y": value} for row, value in zip(space.rows(x), y, strict=True)]
    found = screen(rows, space, "y", transform="log")
    assert found.kriging["scale"] == "log"
    assert min(found.main_effects["a"]["lower"]) > 0.0
    mean = np.expm1(2.0) / 2.0
    at = np.array(found.main_effects["a"]["x"])
    assert found.main_effects["a"]["mean"] == pytest.approx(np.exp(5 * at) * mean, rel=0.02)
    r = [np.expm1(2 * k) / (2 * k) / (np.expm1(k) / k) ** 2 - 1 for k in (5.0, 2.0)]
    whole = (1 + r[0]) * (1 + r[1]) - 1
    assert found.sobol["main"]["a"] == pytest.approx(r[0] / whole, abs=0.01)
    assert found.sobol["total"]["b"] == pytest.approx(r[1] * (1 + r[0]) / whole, abs=0.01)
    assert found.sobol["interactions"][0]["mean"] == pytest.approx(r[0] * r[1] / whole, abs=0.01)


def test_published_methods_keep_to_the_response_unless_told():
    rows = [
        replace(r, outputs={"head": float(np.exp(2.0 * r.outputs["head"]))}) for r in runs(40) if r.outputs
    ]
    plain = screen(rows, SPACE, "head", method="forward", effects=False)
    assert "of left-out runs" not in plain.criterion
    told = screen(rows, SPACE, "head", method="forward", transform="auto", effects=False)
    assert "of left-out runs" in told.criterion

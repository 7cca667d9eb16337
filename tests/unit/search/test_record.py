"""The record of a worst-case search: what it says of its runs, of failures, and along every parameter."""

import json

import numpy as np
import pytest

from workbench import Parameter, Space, worst_case
from workbench.search.record import PROFILE_POINTS, Status, profile_of
from workbench.search.runs.ledger import Ledger
from workbench.search.surrogate.fitting import fit_search_model

SPACE = Space([Parameter("a", lower=-1, upper=2), Parameter("gear", kind="discrete", levels=[1.0, 2.0, 4.0])])


def response(a: float, gear: float) -> float:
    """The worst case is a = 2 in the fourth gear; small a in the first gear fails."""
    if gear == 1.0 and a < 0:
        raise RuntimeError("no contact")
    return a * gear


@pytest.fixture(scope="module")
def found():
    return worst_case(response, SPACE, budget=14, seed=3)


def test_history_holds_the_true_values_in_the_order_run_without_failures(found):
    values = [run.value for run in found.runs if run.value is not None]
    assert found.history.tolist() == values
    assert found.history.max() == found.value == 8.0
    assert len(found.history) + sum(found.failures.values()) == found.evaluations <= 14


def test_failures_are_counted_by_status(found):
    failed = [run.status for run in found.runs if run.value is None]
    assert failed
    assert found.failures == {status: failed.count(status) for status in set(failed)}
    assert found.to_dict()["failures"] == found.failures


def test_the_document_is_plain_json_and_its_best_value_never_falls(found):
    document = json.loads(json.dumps(found.to_dict()))
    assert document["status"] in [status.value for status in Status]
    assert (document["value"], document["parameters"]) == (8.0, {"a": 2.0, "gear": 4.0})
    assert document["label"] == found.label == "confirmed by a true run"
    assert [run["run_key"] for run in document["history"]] == [run.key for run in found.runs]
    best = [run["best"] for run in document["history"] if run["best"] is not None]
    assert (np.diff(best) >= 0).all()
    assert best[-1] == document["value"]
    assert {run["proposal"] for run in document["history"]} >= {"start"}


@pytest.mark.parametrize("sense", ["max", "min"])
def test_the_gap_is_on_record_from_the_start_design_to_the_end(sense):
    found = worst_case(response, SPACE, sense=sense, budget=14, seed=3)
    looks = found.to_dict()["gap_history"]
    runs = [look["runs"] for look in looks]
    assert runs == sorted(set(runs))
    assert looks[-1]["runs"] == len(found.runs)
    assert looks[-1]["full"]
    assert (looks[-1]["upper"], looks[-1]["width"]) == (found.gap.upper, found.gap.width)
    for look in looks:
        values = [run.value for run in found.runs[: look["runs"]] if run.value is not None]
        best = max(values) if sense == "max" else min(values)
        assert abs(look["upper"] - best) == pytest.approx(look["width"], abs=1e-12)
        assert look["share"] == pytest.approx(look["width"] / np.ptp(values))
        assert look["iteration"] == look["runs"]


def test_a_certificate_is_the_last_look():
    found = worst_case(response, SPACE, budget=12, seed=3, lipschitz=40.0)
    assert [look.kind for look in found.gap_history][-1] == "Lipschitz"
    assert found.gap_history[-1].width == found.gap.width


def test_the_best_value_of_a_minimum_never_rises():
    low = worst_case(lambda a, gear: (a - 0.5) ** 2 + gear, SPACE, sense="min", budget=12, seed=1)
    best = [run["best"] for run in low.to_dict()["history"]]
    assert (np.diff(best) <= 0).all()
    assert best[-1] == low.value == low.history.min()


@pytest.mark.parametrize(("sense", "sign"), [("max", 1.0), ("min", -1.0)])
def test_a_profile_passes_through_the_runs_and_its_band_encloses_it(sense, sign):
    rows = [{"a": a, "gear": gear, "y": a * gear} for a in (-1.0, 0.5, 2.0) for gear in (1.0, 2.0, 4.0)]
    ledger = Ledger.opened(SPACE, response="y", sense=sense, start=rows, progress=None)
    model = fit_search_model(ledger.where.features(ledger.u_ok), ledger.v, previous=None, seed=0)
    profile = profile_of(ledger, model, ledger.incumbent)
    assert list(profile) == ["a", "gear"]
    assert len(profile["a"]["x"]) == PROFILE_POINTS
    assert profile["gear"]["x"] == [1.0, 2.0, 4.0]
    for band in profile.values():
        low, middle, high = (np.array(band[name]) for name in ("lower", "mean", "upper"))
        assert (low <= middle + 1e-9).all()
        assert (middle <= high + 1e-9).all()
    a = ledger.best.parameters["a"]
    assert profile["gear"]["mean"] == pytest.approx([a, 2 * a, 4 * a], abs=1e-3)
    assert sign * profile["a"]["mean"][-1] == pytest.approx(
        sign * 2.0 * ledger.best.parameters["gear"], abs=1e-3
    )

"""The model's own gradients: the last steps of a search, and evidence of monotonicity."""

import numpy as np
import pytest

from workbench.search.proposals.gradient_ascent import runs_kept_back
from workbench.search.runs.ledger import Ledger
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space

EXACT = 1e-8  # a quasi-Newton climb on a smooth peak, against the peak's height of one
BOX = Space([Parameter(name, lower=-1.0, upper=2.0, unit="m") for name in ("a", "b", "c")])
TOP = {"a": 0.31, "b": 1.17, "c": -0.43}


def peak(**x):
    """A tilted bump with a known top."""
    d = np.array([x[name] - TOP[name] for name in ("a", "b", "c")])
    A = np.array([[1.0, 0.3, 0.0], [0.3, 0.6, -0.2], [0.0, -0.2, 0.9]])
    return float(np.exp(-d @ A @ d)), dict(
        zip("abc", (-2 * np.exp(-d @ A @ d) * A @ d).tolist(), strict=True)
    )


@pytest.mark.slow
def test_gradients_place_a_smooth_worst_case_exactly():
    with_gradients = worst_case(peak, BOX, budget=40, seed=0)
    without = worst_case(lambda **x: peak(**x)[0], BOX, budget=40, seed=0)
    assert 1 - with_gradients.value < EXACT
    assert 1 - with_gradients.value < 1 - without.value
    assert with_gradients.evaluations <= 40
    assert any(run.proposal == "gradient" for run in with_gradients.runs)
    assert not any(run.proposal == "gradient" for run in without.runs)


def test_small_is_bad_with_gradients_too():
    found = worst_case(
        lambda a, b: ((a - 0.5) ** 2 + (b - 0.2) ** 4, {"a": 2 * (a - 0.5), "b": 4 * (b - 0.2) ** 3}),
        Space([Parameter("a", lower=0.0, upper=10.0), Parameter("b", lower=0.0, upper=1.0)]),
        sense="min",
        budget=30,
        seed=1,
    )
    assert found.value < 1e-5


@pytest.mark.slow
def test_gradients_of_a_response_by_name_respect_levels_and_failures():
    space = Space(
        [
            Parameter("a", lower=0.0, upper=1.0),
            Parameter("on", kind="binary"),
            Parameter("b", lower=0.1, upper=10.0),
        ]
    )

    def model(a, on, b):
        if a > 0.9:
            raise RuntimeError("diverged")
        y = on * np.sin(3 * a) - np.log(b) ** 2
        return {"y": y, "z": 1.0}, {"y": {"a": 3 * on * np.cos(3 * a), "b": -2 * np.log(b) / b}}

    found = worst_case(model, space, response="y", budget=50, seed=0)
    assert found.parameters["on"] == 1
    assert found.value == pytest.approx(1.0, abs=1e-4)


def test_the_audit_reads_signs_off_the_gradients():
    found = worst_case(lambda a, b, c: (a - b * b, {"a": 1.0, "b": -2 * b, "c": 0.0}), BOX, budget=20, seed=0)
    assert found.audit.gradient_signs["a"] == "rising"
    assert found.audit.gradient_signs["b"] == "mixed"
    assert found.audit.gradient_runs == found.evaluations
    assert any("have one sign for a, c and both signs for b" in text for text in found.audit.sentences)


def test_no_runs_are_kept_back_without_gradients():
    ledger = Ledger.opened(
        BOX, response=None, sense="max", start=[{"a": 0, "b": 0, "c": 0, "y": 1.0}], progress=None
    )
    assert runs_kept_back(ledger, 40) == 0
    ledger.slopes[0] = np.zeros(3)
    assert runs_kept_back(ledger, 40) == 6
    assert runs_kept_back(ledger, 9) == 3


def test_a_gradient_that_is_no_number_fails_the_run():
    found = worst_case(
        lambda a, b, c: (a, {"a": "steep", "b": 0, "c": 0}) if a > 1.9 else a, BOX, budget=14, seed=0
    )
    failed = [run for run in found.runs if run.status == "failed"]
    assert failed

"""What a search said of its layout over the cases known then is not said of those that joined later."""

from types import SimpleNamespace

import numpy as np
import pytest

from workbench.robust_layout.judged import JudgedLayouts
from workbench.robust_layout.loop_documents import over_all_cases
from workbench.robust_layout.record import promise_of, promise_over, reasons_against_green

CONVERGED = "Converged: no feasible change promises a noticeable improvement to first order."
SOURCE = {"status": CONVERGED, "verdicts": ["To first order at most 3e-09 % is left."], "kkt": 3e-11}


def judged(*values):
    outcomes = [SimpleNamespace(status="ok", outputs={"rise": v}) for v in values]
    return JudgedLayouts(
        evaluator=lambda density: lambda cases, purpose: outcomes, response="rise",
        cases=[{"k": k} for k in range(len(values))], layouts={"round 1": np.ones(2)},
        documents={"round 1": {**SOURCE, "value": 0.16, "converged": True}},
    )  # fmt: skip


def test_the_promise_grows_by_what_later_cases_lie_above_the_optimum():
    """The optimum in some cases, 0.4 = sqrt(0.16), bounds every layout's worst in all of them from below."""
    known, later = (
        judged(*values).told("round 1", lambda value: value**0.5) for values in ((0.3, 0.4), (0.3, 0.4, 0.41))
    )
    assert known["kkt"] == pytest.approx(3e-11)
    assert later["kkt"] == pytest.approx(0.01 / 0.41)
    assert judged(0.3).told("uniform", lambda value: value) is None


@pytest.mark.parametrize("beyond", [0.0, 1e-3, 0.02, 0.5])
@pytest.mark.parametrize("kkt", [0.0, 0.01])
def test_no_promise_goes_below_the_least_that_the_earlier_cases_allow(beyond, kkt):
    optimum = 1.0
    worst = optimum * (1 + beyond)
    promise = promise_over({"kkt": kkt}, beyond)
    assert worst * (1 - promise) == pytest.approx(optimum * (1 - kkt))
    assert promise_over({"kkt": None}, beyond) is None


def test_more_than_the_allowed_promise_is_amber():
    worst = SimpleNamespace(attack=None, disbelieved=())
    document = {"kkt": promise_over({"kkt": 1e-9}, 0.03), "converged": True}
    said = reasons_against_green(worst, document, SimpleNamespace(agrees=True), closed=True)
    assert len(said) == 1
    assert said[0].startswith("the optimiser ended where the first-order condition is off by 2.9 %: a better")


def test_a_reader_learns_of_which_cases_the_verdicts_are():
    told = over_all_cases({**SOURCE, "kkt": 0.0194}, optimum=0.3243, bound=0.3307, unit="m")
    assert told["status"] == (
        f"{CONVERGED} Over the cases known then it has 0.3243 m, over all that were found 0.3307 m, of which "
        "1.9 % may be left to gain."
    )
    assert told["verdicts"] == [
        "What follows is of the search over the cases known then.", "To first order at most 3e-09 % is left.",
    ]  # fmt: skip
    assert over_all_cases(SOURCE, optimum=0.3243, bound=0.3243, unit="m") == {}
    assert promise_of({"kkt": None}) == float("inf")

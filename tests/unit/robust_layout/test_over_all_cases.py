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
    model = SimpleNamespace(response="rise", as_response=lambda value: value**0.5)
    return JudgedLayouts(
        evaluator=lambda density: lambda cases, purpose: outcomes, model=model,
        cases=[{"k": k} for k in range(len(values))], layouts={"round 1": np.ones(2)},
        documents={"round 1": {**SOURCE, "value": 0.16, "converged": True}},
    )  # fmt: skip


def test_the_promise_grows_by_what_later_cases_lie_above_the_optimum():
    """The optimum in some cases, 0.4 = sqrt(0.16), bounds every layout's worst in all of them from below."""
    known, later = (judged(*values).told("round 1") for values in ((0.3, 0.4), (0.3, 0.4, 0.41)))
    assert known["kkt"] == pytest.approx(3e-11)
    assert later["kkt"] == pytest.approx(0.01 / 0.41)
    assert judged(0.3).told("uniform") is None


@pytest.mark.parametrize(
    ("later", "left"),
    [
        ({"value": 0.1596, "kkt": 0.01}, (0.41 - 0.1596**0.5 * 0.99) / 0.41),
        ({"value": 0.16, "kkt": 0.2}, None),  # promises more than the search before it
        ({"value": 0.1596, "kkt": None}, None),
    ],
)
def test_a_search_that_went_on_tells_what_is_left_where_it_promises_less(later, left):
    found = judged(0.3, 0.4, 0.41)
    found.documents["round 1"] = {**found.documents["round 1"], "kkt": 0.06}
    found.continued["round 1"] = later
    told = found.told("round 1")
    if left is None:
        assert told["kkt"] == pytest.approx((0.41 - 0.4 * 0.94) / 0.41)
        assert "went_on" not in told
    else:
        assert told["kkt"] == pytest.approx(left)
        assert told["went_on"] == {"value": later["value"] ** 0.5, "kkt": 0.01}


@pytest.mark.parametrize(
    ("values", "changed", "later", "unsettled"),
    [
        ((0.4,), {}, None, False),
        ((0.4, 0.43), {}, None, True),  # the optimum was of the cases known then
        ((0.4, 0.43), {}, {"value": 0.43**2, "kkt": 0.01}, False),
        ((0.4,), {"kkt": 0.06}, None, True),
        ((0.4,), {"kkt": 0.06}, {"value": 0.16, "kkt": 0.03}, True),
        ((0.4,), {"kkt": None}, None, False),
        ((0.4,), {"kkt": None, "converged": False}, None, True),
    ],
)
def test_a_layout_is_unsettled_where_more_than_allowed_may_be_left_over_all_cases(
    values, changed, later, unsettled
):
    found = judged(*values)
    found.documents["round 1"] = {**found.documents["round 1"], **changed}
    if later is not None:
        found.continued["round 1"] = later
    assert found.is_unsettled("round 1") is unsettled
    assert not found.is_unsettled("uniform")


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
        "1.9 % may be left to gain, to first order."
    )
    assert told["verdicts"] == [
        "What follows is of the search over the cases known then.", "To first order at most 3e-09 % is left.",
    ]  # fmt: skip
    assert over_all_cases(SOURCE, optimum=0.3243, bound=0.3243, unit="m") == {}
    assert promise_of({"kkt": None}) == float("inf")


@pytest.mark.parametrize(
    ("optimum", "known_then"),
    [
        (0.3243, "Over the cases known then it has 0.3243 m, over all that were found 0.3307 m. "),
        (0.3307, ""),
    ],
)
def test_a_reader_learns_of_the_search_that_went_on(optimum, known_then):
    source = {**SOURCE, "kkt": 0.0164, "went_on": {"value": 0.3286, "kkt": 0.01}}
    told = over_all_cases(source, optimum=optimum, bound=0.3307, unit="m")
    assert told["status"] == (
        f"{CONVERGED} {known_then}A search that went on from it came to 0.3286 m over the cases known to it, "
        "and promised 1 % more: of 0.3307 m 1.6 % may be left to gain, to first order."
    )
    assert told["verdicts"][0] == "What follows is of the search over the cases known then."

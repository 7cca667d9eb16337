"""What is printed of each stage: the screening path like Table 3.1, the worst case, designs side by side."""

from surrogates.screening.hidden_share import percent
from workbench.report.lines.design import design_lines
from workbench.report.lines.layout import layout_lines
from workbench.report.lines.robust import robust_lines
from workbench.report.lines.robust_layout import robust_layout_lines
from workbench.report.lines.screening import left_out_text, method_lines, screening_lines
from workbench.report.lines.statements import (
    border_text,
    minor_text,
    open_text,
    share_of_variance,
    state_text,
)
from workbench.report.lines.tables import format_number
from workbench.report.lines.worst_case import worst_case_lines
from workbench.screening.named_methods import NAMED_METHODS

MANY = [f"x{k}" for k in range(1, 31)]
PATH = {
    "response": "y",
    "unit": "mm",
    "method": "forward",
    "n_left_out": 2,
    "verdict": "",
    "selected": ["x12", "x19"],
    "path": [
        dict(step=1, selected=["x12"], theta_common=0.3883, sigma2=2.2305, log_likelihood=-50.1679),
        dict(step=2, selected=MANY, theta_common=0.1211, sigma2=2.5108, log_likelihood=-44.1308)
        | {"accepted": False},
    ],
}  # fmt: skip


def test_the_screening_path_has_the_form_of_table_3_1():
    text = screening_lines(PATH)
    assert text[0] == "Screening of y [mm]: forward"
    assert text[1].split() == [
        "step",
        "selected",
        "so",
        "far",
        "theta",
        "sigma^2",
        "restricted",
        "log-likelihood",
    ]
    assert text[3].split() == ["1", "x12", "0.3883", "2.2305", "-50.1679"]
    assert max(map(len, text)) <= 80
    assert "selected: x12, x19" in text
    assert any("(not accepted)" in line for line in text)
    assert text[-1] == "2 runs without a value were left out"


def test_a_default_screening_has_no_common_theta_and_says_its_verdict_line_by_line():
    step = dict(step=1, selected=["grip"], theta_common=0.0, sigma2=1.3, log_likelihood=-36.2)
    others = [step | {"step": k, "accepted": False} for k in (2, 3)]
    document = PATH | {
        "method": "default", "state": "partly resolved", "hidden_share": 0.034, "path": [step, *others],
        "scale": "the logarithm of the response (left unexplained: none 0.7 %, log 0.1 %)",
        "verdict": "partly resolved: 3.4 % of the variance may hide further inputs; " + 20 * "very " + "open",
        "advice": "add about 22 runs; put them where grip is above 0.4",
    }  # fmt: skip
    text = screening_lines(document)
    assert text[0] == "Screening of y [mm]: partly resolved, down to 3.4 % of the variance (default)"
    assert not any("theta" in line for line in text)
    assert "1 further step was tried, none accepted" in text
    assert any(line.startswith("screened by the logarithm of the response (left") for line in text)
    at = text.index("partly resolved: 3.4 % of the variance may hide further inputs")
    assert text[at + 1].startswith("  very very")
    assert text[at + 2].startswith("    very")
    assert text[at + 3 : at + 5] == ["to do: add about 22 runs", "  put them where grip is above 0.4"]
    assert max(map(len, text)) <= 80


def test_the_list_of_methods_fits_a_terminal():
    text = method_lines(NAMED_METHODS)
    assert max(map(len, text)) <= 80
    assert {line.split()[0] for line in text if not line.startswith(" ")} == {
        one.name for one in NAMED_METHODS
    }


def test_the_worst_case_says_what_it_rests_on():
    document = {
        "response": "y", "unit": "mm", "sense": "max", "value": 13.31251, "label": "confirmed by a true run",
        "evaluations": 41, "budget": 60, "parameters": {"k": 2.0, "road": "bump"}, "failures": {"failed": 2},
        "gap": {"sentence": "It could be at most 0.9 mm worse."},
    }  # fmt: skip
    text = "\n".join(worst_case_lines(document))
    assert "Worst case (largest y): 13.3125 mm" in text
    assert "confirmed by a true run; 41 runs of at most 60" in text
    assert "  It could be at most 0.9 mm worse." in text
    assert "runs without a value: 2 failed" in text
    assert "  road = bump" in text


def test_cases_of_an_attack_that_were_known_account_for_the_rest_of_the_budget():
    document = {
        "response": "y", "unit": "mm", "sense": "max", "value": 13.3125, "label": "confirmed by a true run",
        "evaluations": 1221, "budget": 1225, "parameters": {"k": 2.0}, "attack": {"runs": 1200},
        "history": [
            {"proposal": "attack: interior" if k > 24 else "start", "value": 13.3125} for k in range(1221)
        ],
    }  # fmt: skip
    text = worst_case_lines(document)
    assert (
        " ".join(text[1:3]).split()
        == (
            "confirmed by a true run; 1221 runs of at most 1225, 4 cases of the attack had been run before"
        ).split()
    )
    assert max(map(len, text)) <= 80


def test_a_failure_that_is_the_worst_case_comes_first_with_its_own_parameters():
    border = {
        "is_answer": True, "sentence": "The worst case is a failure, as a failed run counts as worse.",
        "parameters": {"k": 3.0, "road": "ditch"}, "run_key": "c3",
    }  # fmt: skip
    document = {
        "response": "y", "unit": "mm", "sense": "max", "value": 13.3125, "label": "confirmed by a true run",
        "evaluations": 41, "budget": 60, "parameters": {"k": 2.0, "road": "bump"}, "border": border,
    }  # fmt: skip
    text = worst_case_lines(document)
    assert text[:4] == [
        "Worst case (largest y): a run that failed",
        "  The worst case is a failure, as a failed run counts as worse.",
        "  the worst that gave a value: 13.3125 mm, confirmed by a true run",
        "  41 runs of at most 60",
    ]
    assert [line.split() for line in text[-4:] if "--" not in line] == [
        ["the", "failed", "run", "the", "worst", "that", "gave", "a", "value"],
        ["k", "3", "2"],
        ["road", "ditch", "bump"],
    ]
    assert max(map(len, text)) <= 80
    beside = worst_case_lines({**document, "border": {**border, "is_answer": False}})
    assert beside[0] == "Worst case (largest y): 13.3125 mm"
    assert beside[-2:] == ["  k    = 2", "  road = bump"]


def test_a_predicted_worst_case_stands_beside_the_worst_run_that_exists():
    given = {"runs": 36, "value": 10.64334, "run_key": "c3"}
    document = {
        "response": "y", "unit": "mm", "sense": "max", "value": 38.0, "confirmed": False,
        "label": "surrogate only, unconfirmed", "evaluations": 0, "budget": 0, "parameters": {"k": 2.0},
        "baselines": {"the runs given": given},
        "grade_sentence": "Searched: only the search has looked, by its own surrogate.",
    }  # fmt: skip
    text = worst_case_lines(document)
    assert not any("search" in line for line in text)
    assert text[1:3] == [
        "  surrogate only, unconfirmed",
        "  the worst of the 36 runs given is 10.6433 mm",
    ]
    assert worst_case_lines({**document, "confirmed": True})[2] != text[2]


def test_a_worst_case_and_the_worst_run_are_told_apart_and_runs_without_a_value_left_out():
    document = {
        "response": "y", "unit": "MPa", "sense": "min", "value": 999999999.046, "confirmed": False,
        "label": "surrogate only, unconfirmed", "evaluations": 0, "budget": 0, "parameters": {"k": 2.0},
        "baselines": {"the runs given": {"runs": 65, "failed": 8, "value": 999999999.489, "run_key": "c3"}},
        "status": "no model to run: the extreme of the surrogate, unconfirmed",
    }  # fmt: skip
    text = worst_case_lines(document)
    assert text[0] == "Worst case (smallest y): 999999999.05 MPa"
    assert text[2] == "  the worst of the 57 runs given that have a value is 999999999.49 MPa"
    assert text[3] == "  no model to run: the extreme of the surrogate, unconfirmed"
    searched = {**document, "budget": 9, "confirmed": True, "value": 1e9, "history": [{"value": 1e9 - 4e-4}]}
    assert worst_case_lines(searched)[0] == "Worst case (smallest y): 1000000000 MPa"
    swings = [{"value": 1e9 - 4e-4}, {"value": 1e9}]
    told = worst_case_lines({**searched, "value": 1e9 - 4e-4, "history": swings})[0]
    assert told == "Worst case (smallest y): 999999999.9996 MPa"


def test_numbers_are_short():
    assert [format_number(x) for x in (13.3125, -1e-9, 123456.7, 0.0)] == [
        "13.312",
        "-1e-09",
        "1.2346e+05",
        "0",
    ]


def test_design_layout_and_robust_are_told_within_80_columns():
    quality = {
        "min_distance": {"value": 0.3978, "percentile": 82.0, "better": "high"},
        "cd2": {"value": 0.0255, "percentile": 12.0, "better": "low"},
        "maxpro": {"value": None, "percentile": None, "better": "low"},
    }
    text = design_lines({"quality": quality})
    assert "min distance" in text[2]
    assert "better than 82 %" in text[2]
    assert "better than 88 %" in text[3]
    assert design_lines({}) == []
    layout = {
        "title": "truss", "problem": "m:p", "response": "compliance", "unit": "J",
        "start_value": 2.0, "value": 1.0,
        "evaluations": 7, "method": "gsao", "status": "converged", "shadow_prices": {"mass": 0.25},
        "budgets": [{"name": "mass", "limit": 3.0, "used": 3.0}], "purified": {"value": 1.1, "loss": 0.1},
    }  # fmt: skip
    text = layout_lines(layout)
    assert text[0] == "Layout of truss: compliance 2 -> 1 J"
    assert "shadow price 0.25" in text[2]
    summary = {
        "design": "old", "mean": 1.0, "quantiles": {"P95": [2.0, 1.8, 2.2]}, "worst": 3.0,
        "largest_regret": 0.5,
        "beyond_limit": [0.125, 0.1, 0.2], "failed": 1,
    }  # fmt: skip
    robust = {"unit": "J", "samples": 100, "summaries": [summary], "paired": {"new - old": [-1.0, -2.0, 0.0]}}
    text = robust_lines(robust)
    assert text[0] == "100 points of the uncertainty, J"
    assert "12.5 %" in text[3]
    assert text[-1] == "new - old: -1 (95 %: -2 to 0)"
    assert max(map(len, text)) <= 80


def test_failures_of_a_comparison_are_told_within_80_columns():
    summary = {
        "design": "stiff", "mean": 1.0, "quantiles": {"P95": [2.0, 1.8, None]}, "worst": 3.0,
        "largest_regret": 0.5, "beyond_limit": [0.125, 0.1, 0.2], "failed": 30,
        "failed_share": [0.3, 0.219, 0.396], "beyond_or_failed": [0.45, 0.36, 0.55],
    }  # fmt: skip
    soft = {
        **summary, "design": "soft", "failed": 0, "failed_share": [0.0, 0.0, 0.037],
        "beyond_or_failed": [0.4, 0.3, 0.5],
    }  # fmt: skip
    robust = {
        "unit": "J", "samples": 100, "drawn": 100, "left_out": 30, "limit": 2.5, "paired": {},
        "summaries": [summary, soft],
        "warnings": ["stiff gave no value in 30 of 100 scenarios (30 %), and fails where soft is bad: its "
                     "worst may be hidden in them"],
    }  # fmt: skip
    text = robust_lines(robust)
    assert "left out for every design: 30 of 100 points, in which a run gave no value" in text
    assert "  stiff failed in 30 % (95 %: 21.9 to 39.6 %); failed or beyond 2.5: 45 %" in text
    assert text[-2].startswith("note: stiff gave no value in 30 of 100 scenarios")
    assert "  soft failed in 0 % (95 %: 0 to 3.7 %); failed or beyond 2.5: 40 %" in text
    long = {**summary, "design": "as it stands today, with the old belt and no airbag at all", "failed": 0}
    text += robust_lines({**robust, "summaries": [summary, long], "paired": {long["design"]: [1, 2, 3]}})
    assert max(map(len, text)) <= 80


def test_a_robust_layout_of_a_long_title_is_told_within_80_columns():
    kept = {"worst": 0.1331, "nominal": 0.071, "runs": 1516}
    text = robust_layout_lines({
        "title": "the occupant of a vehicle in severe braking, of whom little is known",
        "response": "peak_deviation", "unit": "m",
        "rounds": [{"cases": 20, "bound": 0.1249, "worst": 0.14802, "gap": 0.185}],
        "status": "1516 true runs of an adversary and its 3000 scouts at a longer step found nothing more",
        "reasons": ["another start came no nearer than 18.1 %, and a better layout may stand nearby"],
        "layouts": {"round 1, evaluations added 1": kept, "robust": kept}, "variants": [],
    })  # fmt: skip
    assert max(map(len, text)) <= 80
    assert " ".join(text).startswith("Robust layout of the occupant of a vehicle in severe braking")
    assert text[-1].split() == ["robust", "0.1331", "0.071", "1516"]


def test_a_round_that_made_no_layout_says_so():
    kept = {"worst": 0.1331, "nominal": 0.071, "runs": 1516}
    made = {"cases": 20, "bound": 0.1326, "worst": 0.1431, "gap": 0.079}
    text = robust_layout_lines({
        "title": "the occupant", "response": "peak_deviation", "unit": "m",
        "rounds": [made, {"cases": 0, "bound": 0.1328, "worst": 0.1331, "gap": 0.003}],
        "status": "closed", "reasons": [], "layouts": {"robust": kept}, "variants": [],
    })  # fmt: skip
    rows = [line.split() for line in text]
    assert ["2", "-", "0.1328", "0.1331", "0.3", "%"] in rows
    assert "-: no layout was made, one was as good in all cases known as what the last was" in text
    assert max(map(len, text)) <= 80


def test_shares_of_ranks_are_said_to_be_theirs_wherever_they_are_told():
    facts = {"shares_of": "ranks", "open": ["grip"], "open_share": 0.034, "border": ["mass"]}
    screening = {
        "state": "partly resolved",
        "hidden_share": 0.093,
        "selected": ["grip", "mass"],
        "minor": ["tyre"],
        "ranking": ["grip", "mass", "tyre", "road"],
        "diagnosis": facts,
    }
    of_ranks = "of the variance of the ranks"
    assert state_text(screening) == f"partly resolved, down to 9.3 % {of_ranks}"
    for said in (open_text(screening), border_text(screening), minor_text(screening)):
        assert of_ranks in said
    own = screening | {"diagnosis": facts | {"shares_of": "response"}}
    for said in (state_text(own), open_text(own), border_text(own), minor_text(own)):
        assert "of the variance" in said
        assert "ranks" not in said


def test_where_all_parameters_are_selected_no_share_is_told_down_to_which_they_are():
    screening = {"state": "partly resolved", "hidden_share": 0.093, "selected": ["grip"], "minor": ["tyre"]}
    every = screening | {"ranking": ["grip", "tyre", "road"], "diagnosis": {"constant": ["road"]}}
    assert state_text(every) == "partly resolved, every parameter selected or listed apart"
    selected = every | {"selected": ["grip", "tyre"], "minor": []}
    for state in ("partly resolved", "resolved"):
        assert state_text(selected | {"state": state}) == f"{state}, all parameters selected"
    assert "down to 9.3 %" in state_text(every | {"diagnosis": {}})


def test_one_is_not_told_in_the_plural():
    assert left_out_text(1) == "1 run without a value was left out"
    assert left_out_text(2) == "2 runs without a value were left out"


def test_shares_are_said_as_verdicts_say_them():
    shares = [0.0, 1e-6, 9.4e-4, 0.0042, 0.034, 0.0994, 0.0996, 0.345, 1.0]
    assert [share_of_variance(share) for share in shares] == [percent(share) for share in shares]

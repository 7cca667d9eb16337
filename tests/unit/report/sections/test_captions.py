"""What stands under a figure is true of its document: the other sense, noise, a rejected step."""

import pytest

from workbench.report.contents import DOCUMENTS
from workbench.report.page.folder import CampaignFolder
from workbench.report.page.run_list import RunList
from workbench.report.sections.robust import robust_section
from workbench.report.sections.screening import _why_rejected
from workbench.report.worst_case.figures import profile_figure, search_figure
from workbench.report.worst_case.tables import ranked_runs
from workbench.robust.re_evaluation import re_evaluate
from workbench.search.worst_case import surrogate_worst_case, worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=-1.0, upper=2.0, unit="m")])


def opened(tmp_path, **documents):
    return CampaignFolder(
        path=tmp_path, lock={}, documents=dict.fromkeys(DOCUMENTS) | documents, runs=RunList()
    )


@pytest.mark.parametrize(
    ("sense", "end", "paying"),
    [
        ("max", "upper end", "crosses above it are"),
        ("min", "lower end", "dots below it, where it differs, are"),
    ],
)
def test_who_pays_for_a_change_depends_on_what_is_bad(tmp_path, sense, end, paying):
    compared = re_evaluate(
        lambda x, u: x["k"] * u["a"], {"soft": {"k": 1.0}, "stiff": {"k": 2.0}}, BOX, samples=20, sense=sense
    )
    section = robust_section(opened(tmp_path, robust=compared.to_dict()))
    said = {block.id: block.read_off for block in section.blocks if hasattr(block, "read_off")}
    assert f"look at its {end} for the rare bad" in said["distributions"]
    assert f"{paying} scenarios that pay for the change" in said["pairs"]


def test_a_single_run_does_not_confirm_a_mean(tmp_path):
    draws = iter([0.1, -0.2, 0.05, 0.3, -0.1, 0.2, -0.3] * 9)

    def noisy(a):
        return a + next(draws)

    worst = worst_case(noisy, BOX, budget=20, seed=0, noise=True).to_dict()
    history, folder = worst["history"], opened(tmp_path)
    figure = search_figure(folder, worst, history, "height", "m")
    assert "The first run of the mean (ring) was run" in figure.read_off
    assert figure.alt.endswith(f"which ends at {history[-1]['best']:.6g}.")
    assert (
        "red dot is the mean of the repeated runs"
        in profile_figure(folder, worst, history, "height", "m").read_off
    )
    table = ranked_runs(folder, worst, history, "height", "m")[0]
    assert {row[2] for row in table.rows} <= {"", "first run of the mean"}
    assert table.title.endswith("worst true runs of the search")


def test_runs_of_a_table_are_not_called_runs_of_a_search(tmp_path):
    start = [{"a": a, "height": a * a} for a in (-1.0, 0.0, 0.5, 1.0, 1.5)]
    worst = surrogate_worst_case(BOX, start, response="height").to_dict()
    history, folder = worst["history"], opened(tmp_path)
    table = ranked_runs(folder, worst, history, "height", "m")[0]
    assert table.title == "The 5 worst of the runs given"
    figure = search_figure(folder, worst, history, "height", "m")
    assert (figure.title, figure.table.title) == ("The runs given", "All runs given")
    assert {row[0] for row in figure.table.rows} == {None}


@pytest.mark.parametrize(
    ("gain", "threshold", "said"),
    [(1.0, 2.0, ": too little to count"), (3.0, 2.0, ""), (None, 2.0, ""), (1.0, None, "")],
)
def test_a_rejected_step_is_called_too_small_only_where_it_is(gain, threshold, said):
    assert _why_rejected({"gain": gain}, threshold) == said

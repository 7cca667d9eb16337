"""What the report says about a worst case that the search has just found."""

import json

import matplotlib.pyplot as plt
import pytest

from workbench.report.contents import DOCUMENTS
from workbench.report.lines.worst_case import worst_case_lines
from workbench.report.page.blocks import Figure, Note, Table
from workbench.report.page.folder import CampaignFolder
from workbench.report.page.run_list import RunList
from workbench.report.worst_case.figures import baseline_figures
from workbench.report.worst_case.gap_figure import gap_figure
from workbench.report.worst_case.section import gap_sentence, worst_case_section
from workbench.report.worst_case.tables import audit_blocks
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage

BOX = Space([Parameter("a", lower=-1.0, upper=2.0, unit="m"), Parameter("b", lower=0.0, upper=1.0)])


@pytest.fixture(scope="module")
def document():
    return worst_case(lambda a, b: a * a - b, BOX, budget=12, seed=0).to_dict()


def test_what_a_flat_response_may_mean_is_said_once():
    flat = worst_case(lambda a, b: 3.0, BOX, budget=22, seed=0).to_dict()
    for text in (" ".join(worst_case_lines(flat)), f"{flat['status']} {gap_sentence(flat)}"):
        assert " ".join(text.split()).count("ignores its inputs") == 1
    assert "stopped because every run gave the same value" in " ".join(worst_case_lines(flat))


@pytest.fixture
def folder(tmp_path):
    return CampaignFolder(path=tmp_path, lock={}, documents=dict.fromkeys(DOCUMENTS), runs=RunList())


def test_true_runs_of_plain_ways_stand_beside_the_search(document, folder):
    (figure,) = baseline_figures(folder, document, "height", "m")
    rows = {row[0]: row for row in figure.table.rows}
    assert set(rows) == {"this search", "the start design"}
    assert rows["this search"][1:3] == (12, 4.0)
    start = [h["value"] for h in document["history"] if h["proposal"] == "start"]
    assert rows["the start design"][1:3] == (len(start), max(start))
    assert "nothing is predicted" in figure.read_off


def run(number, proposal, value, best):
    key = f"k{number}{proposal[:1]}"
    return {"iteration": number, "proposal": proposal, "value": value, "best": best, "run_key": key}


def test_what_the_attack_found_is_not_called_the_find_of_the_search(folder):
    history = [
        run(1, "start", 1.0, 1.0), run(2, "ei", 3.0, 3.0), run(3, "attack: corner", 5.0, 5.0),
        run(4, "attack: interior", None, 5.0),
    ]  # fmt: skip
    given = {"the start design": {"runs": 1, "value": 1.0, "run_key": "k1s"}}
    worst = {"value": 5.0, "sense": "max", "run_key": "k3a", "history": history, "baselines": given}
    (figure,) = baseline_figures(folder, worst, "height", "m")
    assert [row[:3] for row in figure.table.rows] == [
        ("this search", 2, 3.0), ("the attack on it", 2, 5.0), ("the start design", 1, 1.0),
    ]  # fmt: skip
    assert "this search (2 runs) 3, the attack on it (2 runs) 5" in figure.alt
    worst["history"] = [*history[:2], run(3, "attack: corner", 2.0, 3.0)]
    (figure,) = baseline_figures(folder, worst, "height", "m")
    assert [row[0] for row in figure.table.rows] == ["this search", "the start design"]


def test_where_nothing_was_searched_nothing_is_compared(folder):
    given = {"the runs given": {"runs": 1, "value": 5.0, "run_key": "k0g"}}
    worst = {"value": 5.0, "sense": "max", "history": [run(0, "given", 5.0, 5.0)], "baselines": given}
    assert baseline_figures(folder, worst, "height", "m") == []


@pytest.mark.parametrize(("sense", "sign"), [("max", 1.0), ("min", -1.0)])
def test_bounds_that_did_not_hold_are_counted(sense, sign):
    history = [run(k, "ei", sign * v, sign * v) for k, v in enumerate((1.0, 2.0, 3.0, 4.0), start=1)]
    looks = [
        {
            "runs": k, "iteration": k, "upper": sign * upper, "width": 0.5, "share": 0.5,
            "kind": "model-based", "full": True,
        }
        for k, upper in ((2, 2.5), (3, 4.5), (4, 4.5))
    ]  # fmt: skip
    worst = {"sense": sense, "gap_history": looks, "gap": {"upper": sign * 4.5}}
    said = gap_figure(worst, history, "height", "m").read_off
    assert "Runs followed on 2 of the 3 bounds; 1 of them did not hold." in said
    held = {**worst, "gap_history": looks[1:]}
    assert (
        "on 1 of the 2 bounds; none of them was exceeded."
        in gap_figure(held, history, "height", "m").read_off
    )


def test_a_search_that_ends_without_a_bound_says_so_below_its_last_one(document):
    without = {**document, "gap": {**document["gap"], "upper": None, "width": None}}
    figure = gap_figure(without, document["history"], "height", "m")
    assert "In the end no bound is stated." in figure.read_off
    assert "In the end no bound is stated." in figure.alt
    assert "no bound" not in gap_figure(document, document["history"], "height", "m").read_off


def test_without_baselines_nothing_is_shown(folder):
    assert baseline_figures(folder, {"value": 1.0}, "height", "m") == []


def test_the_gap_is_told_in_a_sentence(document):
    assert gap_sentence(document) == document["gap"]["sentence"].replace(" %", "\N{NO-BREAK SPACE}%")
    assert gap_sentence({"gap": None}) == "No bound on how much worse it could be was computed."


def test_the_gap_is_drawn_beside_the_worst_so_far(document):
    figure = gap_figure(document, document["history"], "height", "m")
    assert [column.heading for column in figure.table.columns][2:5] == [
        "bound [m]", "gap [m]", "share of the range seen [%]",
    ]  # fmt: skip
    first, last = figure.table.rows[0], figure.table.rows[-1]
    assert (last[3], last[6]) == (document["gap"]["width"], "full")
    assert first[4] == pytest.approx(100.0 * document["gap_history"][0]["share"])
    assert "quick looks" in figure.read_off
    assert "after 12" in figure.alt


def test_a_gap_that_was_stated_once_has_no_history(document):
    assert gap_figure({**document, "gap_history": document["gap_history"][:1]}, [], "height", "m") is None
    assert gap_figure({"response": "height"}, [], "height", "m") is None  # of an earlier version


MIXED = """
[study]
name = "mixed"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "mass"
lower = 50
upper = 110
unit = "kg"
[[parameter]]
name = "road"
kind = "categorical"
levels = ["flat", "bump", "ice"]
[[parameter]]
name = "belt"
kind = "binary"
[[parameter]]
name = "teeth"
kind = "integer"
lower = 10
upper = 20
[[parameter]]
name = "ratio"
baseline = 2.0
factor = [0.5, 2.0]
[[parameter]]
name = "gear"
kind = "discrete"
levels = [1.0, 2.0, 5.0]
[[response]]
name = "force"
unit = "N"
[design]
kind = "sobol"
runs = 16
[evaluate]
engine = "inline"
[worst_case]
response = "force"
budget = 8
"""
MODEL = """
def f(mass, road, belt, teeth, ratio, gear):
    if road == "ice" and mass < 60:
        raise ValueError("slips")
    return 0.02 * mass + {"flat": 0.0, "bump": 2.0, "ice": 1.0}[road] + belt + 0.1 * gear + 0.0 * teeth
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """The folder of a search over every kind of parameter, some runs failed."""
    place = tmp_path_factory.mktemp("mixed")
    (place / "m.py").write_text(MODEL)
    (place / "s.toml").write_text(MIXED)
    with Campaign.from_file(place / "s.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        run_stage(campaign, "worst_case")
        return campaign.folder


def block(folder, name):
    section = worst_case_section(CampaignFolder.opened(folder, documents=DOCUMENTS))
    return next((b for b in section.blocks if isinstance(b, (Figure, Table)) and b.id == name), None)


NAMES = ["mass", "road", "belt", "teeth", "ratio", "gear"]


def test_all_runs_of_the_search_come_with_their_parameters(mixed):
    table = block(mixed, "search").table
    assert [c.heading for c in table.columns][-6:] == ["mass [kg]", "road", "belt", "teeth", "ratio", "gear"]
    history = json.loads((mixed / "worst_case.json").read_text())["history"]
    assert [row[-6:] for row in table.rows] == [
        tuple(h["parameters"][name] for name in NAMES) for h in history
    ]
    assert "failed" in {row[3] for row in table.rows}


def test_ranked_runs_differ_in_a_column(mixed, tmp_path):
    document = {"selected": ["mass", "belt"], "response": "force"}
    folder = CampaignFolder.opened(mixed, documents=DOCUMENTS)
    folder.documents["screening"] = document
    section = worst_case_section(folder)
    (table,) = (b for b in section.blocks if isinstance(b, Table) and b.id == "worst-runs")
    names = [c.name for c in table.columns][7:]
    assert names[:2] == ["mass", "belt"]
    assert "ratio" == names[-1]  # a continuous input comes behind those with levels
    inputs = [row[7:] for row in table.rows]
    assert len(set(inputs)) == len(inputs)


def test_many_differing_parameters_are_named_below_the_ranked_runs():
    names = [f"p{k}" for k in range(15)]
    history = [
        {"run_key": str(i), "value": float(i), "parameters": dict.fromkeys(names, i)} for i in range(3)
    ]
    worst = {
        "response": "y", "sense": "max", "value": 2.0, "confirmed": True, "label": "", "run_key": "2",
        "parameters": history[2]["parameters"], "history": history,
    }  # fmt: skip
    folder = CampaignFolder(
        path=None, runs=RunList(), lock={},
        documents=dict.fromkeys(("design", "screening", "layout"), None) | {"worst_case": worst},
    )  # fmt: skip
    section = worst_case_section(folder)
    (note,) = (b for b in section.blocks if isinstance(b, Note))
    assert note.text.startswith("These runs also differ in p12, p13 and p14: ")


def test_parallel_axes_have_levels_with_words(mixed):
    figure = block(mixed, "parallel")
    assert [c.name for c in figure.table.columns][2:] == NAMES
    picture, ax = plt.subplots()
    figure.panels[0].draw(ax)
    texts = [(note.get_text(), note.xy) for note in ax.texts]
    plt.close(picture)
    assert texts[2:7] == [("flat", (1, 0.0)), ("bump", (1, 0.5)), ("ice", (1, 1.0)), ("0", (2, 0.0)),
                          ("1", (2, 1.0))]  # fmt: skip
    assert texts[7:9] == [("10", (3, 0.0)), ("20", (3, 1.0))]
    assert texts[9:11] == [("1", (4, 0.0)), ("4", (4, 1.0))]
    assert [text for text, _ in texts[11:]] == ["1", "2", "5"]
    assert [label.get_text() for label in ax.get_xticklabels()][:2] == ["mass\n[kg]", "road"]


def test_parallel_axes_stay_when_one_parameter_was_selected(mixed):
    folder = CampaignFolder.opened(mixed, documents=DOCUMENTS)
    folder.documents["screening"] = {"selected": ["belt"], "response": "force"}
    section = worst_case_section(folder)
    (figure,) = (b for b in section.blocks if isinstance(b, Figure) and b.id == "parallel")
    assert [c.name for c in figure.table.columns][2:4] == ["belt", "mass"]


def test_bounds_of_discrete_combinations_are_shown_with_the_unit_of_the_response(folder):
    space = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("on", kind="binary")])
    document = worst_case(lambda a, on: a * (1 + on), space, budget=12, seed=0).to_dict()
    tables = {b.id: b for b in audit_blocks(folder, {**document, "unit": "mm"}) if isinstance(b, Table)}
    heads = [column.heading for column in tables["combinations"].columns]
    assert {"worst [mm]", "bound [mm]", "runs", "open"} <= set(heads)

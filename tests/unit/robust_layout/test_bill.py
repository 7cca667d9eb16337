"""The bill of materials in a campaign's folder: JSON, CSV, and the section of the report."""

import csv
import json
from itertools import pairwise

import numpy as np
import pytest

from studies.whole_members import random_problem
from tests.sample_layout import TwoMembers
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.report.contents import DOCUMENTS
from workbench.report.layout.bill import bill_section
from workbench.report.page.folder import CampaignFolder
from workbench.robust_layout.bill import CSV, JSON, layout_bill, robust_bill, write_bill
from workbench.stages.layout import run_layout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bill")
    springs, _ = random_problem(1, most=1500)
    run_layout(folder, problem=springs, evaluations=5, purified=False)
    return folder


def test_json_and_csv_say_the_same(folder):
    document = json.loads((folder / JSON).read_text())
    layout = json.loads((folder / "layout.json").read_text())
    rows = list(csv.DictReader((folder / CSV).read_text().splitlines()))
    assert len(rows) == len(document["members"])
    assert len(rows) + document["left_out"]["members"] == len(layout["members"])
    for row, member in zip(rows, document["members"], strict=True):
        assert float(row["density"]) == member["density"] == layout["density"][member["member"]]
        assert float(row["tension [N]"]) == member["tension"]["value"]
        assert row["energy in"] == member["energy"]["scenario"]
        assert row["name"] == member["name"] == layout["members"][member["member"]]["name"]
        assert [float(row["a_x [m]"]), float(row["a_y [m]"])] == member["a"]
    densities = [member["density"] for member in document["members"]]
    assert densities == sorted(densities, reverse=True)


def test_the_section_names_the_hardest_member_and_draws_the_bodies(folder):
    from matplotlib.figure import Figure as Canvas

    section = bill_section(CampaignFolder.opened(folder, documents=DOCUMENTS))
    document = json.loads((folder / JSON).read_text())
    hardest = max(document["members"], key=lambda m: max(m["tension"]["value"], m["compression"]["value"]))
    assert f"in member {hardest['name']} at" in section.sentences[1]
    views, table = section.blocks
    assert len(views.panels) == 1
    ax = Canvas().add_subplot()
    views.panels[0].draw(ax)
    assert {text.get_text() for text in ax.texts} == {"1", "2"}
    assert len(table.rows) == len(document["members"])
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_space_is_drawn_in_three_views(tmp_path):
    from matplotlib.figure import Figure as Canvas

    extreme = {"value": 2.0, "time": 0.1, "scenario": "crash"}
    member = {
        "member": 0, "name": "strut", "kind": "spring", "body_a": "seat", "a": [0.0, 0.0, 1.0],
        "body_b": "ground", "b": [1.0, 2.0, 0.0], "length": 2.4, "density": 1.0, "shares": {},
        **dict.fromkeys(("tension", "compression", "stretch", "shortening", "energy"), extreme),
    }  # fmt: skip
    corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 2.0], [1.0, 1.0, 1.5]]
    write_bill(tmp_path, {
        "members": [member], "left_out": {"members": 3, "shares": {"mass": 0.01}}, "budgets": [],
        "scenarios": ["crash", "roll"], "bodies": [{"name": "seat", "points": corners}],
    })  # fmt: skip
    section = bill_section(CampaignFolder.opened(tmp_path, documents=DOCUMENTS))
    panels = section.blocks[0].panels
    assert [panel.title for panel in panels] == ["side", "top", "front"]
    labels = []
    for panel in panels:
        ax = Canvas().add_subplot()
        panel.draw(ax)
        labels.append((ax.get_xlabel(), ax.get_ylabel()))
        across, up = ("xyz".index(label[0]) for label in labels[-1])
        assert [text.get_text() for text in ax.get_legend().get_texts()] == ["spring"]
        ends = [[end[across], end[up]] for end in (member["a"], member["b"])]
        drawn = [line.get_xydata().tolist() for line in ax.lines]  # a gap between two members of a line
        assert ends in [[a, b] for line in drawn for a, b in pairwise(line)]
    assert labels == [("x [m]", "z [m]"), ("x [m]", "y [m]"), ("y [m]", "z [m]")]
    assert (
        "3 members with next to no density are left out; together they use 1 % of 'mass'."
        in section.sentences
    )
    assert "crash" in section.blocks[1].rows[0]


def test_without_runs_there_is_no_bill_and_an_old_one_goes(tmp_path):
    model = TwoMembers(forbidden=-0.5)
    assert layout_bill(model.problem([{"u": 0.0, "v": 0.0}]), np.ones(2)) is None
    with pytest.raises(InvalidLayout):
        model.problem([{"u": -1.0, "v": 0.0}])
    assert robust_bill(model, [{"u": -1.0, "v": 0.0}], np.ones(2)) is None
    for name in (JSON, CSV):
        (tmp_path / name).write_text("old")
    write_bill(tmp_path, None)
    assert not list(tmp_path.iterdir())

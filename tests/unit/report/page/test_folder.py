"""A campaign's folder as the report sees it: how a parameter is given does not change what is shown of it."""

import pytest

from workbench.report.contents import DOCUMENTS
from workbench.report.page.folder import CampaignFolder
from workbench.report.page.run_list import RunList
from workbench.report.sections.profiler import _parameter
from workbench.report.worst_case.tables import place_table
from workbench.space.box import Parameter, Space

LAW = {"name": "uniform", "loc": 0.1, "scale": 0.3}


def opened(tmp_path, *, design=None, resolved=None):
    documents = dict.fromkeys(DOCUMENTS) | {"design": design}
    return CampaignFolder(
        path=tmp_path, lock={"resolved": {"parameter": resolved or []}}, documents=documents, runs=RunList()
    )


def test_multiples_of_a_baseline_have_bounds_on_the_page(tmp_path):
    space = Space([Parameter("gap", baseline=0.2, factor=(0.5, 2.0), unit="mm")])
    folder = opened(tmp_path, design={"space": space.to_dict()})
    slider = _parameter(folder.parameters["gap"], None)
    assert (slider["lower"], slider["upper"]) == (0.1, 0.4)
    table = place_table(folder, {"parameters": {"gap": 0.4}}, "MPa")
    assert table.rows == (("gap", 0.4, "mm", 0.1, 0.4, "upper bound"),)


@pytest.mark.parametrize("given", [{"baseline": -2.0, "factor": [0.5, 2.0]}, {"distribution": LAW}])
def test_so_they_have_in_a_study_without_a_design(tmp_path, given):
    folder = opened(tmp_path, resolved=[{"name": "gap", **given}])
    wanted = Parameter.from_dict({"name": "gap", **given})
    shown = folder.parameters["gap"]
    assert (shown["lower"], shown["upper"]) == (wanted.lower, wanted.upper)

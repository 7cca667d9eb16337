"""Attacks when the rounds of a robust loop are spent: how many, and what is said of what none is left for."""

import pytest

from tests.sample_layout import STUDY
from workbench.robust_layout import loop as loop_module
from workbench.robust_layout.loop import _Loop
from workbench.robust_layout.model import layout_name
from workbench.stages.campaign import Campaign
from workbench.study.loading import parse_study


def run(folder, *, rounds):
    path, text = folder / "two.toml", STUDY.replace("rounds = 5", f"rounds = {rounds}")
    path.write_text(text)
    with Campaign(parse_study(text, path=path)) as campaign:
        return campaign.run()["robust_layout"], campaign.folder


@pytest.fixture
def attacked(monkeypatch):
    """Every attack breaks its layout, so that another is the best: it is attacked in its turn, and so on."""
    names, keep = [], _Loop.keep

    def broken(loop, name, found):
        found = keep(loop, name, found)
        if found.attack is not None:
            names.append(name)
            answers = loop.judged._answers[layout_name(loop.judged.layouts[name])]
            last = repr(sorted(loop.judged.cases[-1].items()))
            answers[last] = 2 * max(loop.judged.values(name))
        return found

    monkeypatch.setattr(_Loop, "keep", broken)
    return names


@pytest.mark.slow
def test_what_no_attack_is_left_for_is_not_called_attacked(tmp_path, monkeypatch, attacked):
    monkeypatch.setattr(loop_module, "LAST", 1)
    found, folder = run(tmp_path, rounds=1)
    assert len(attacked) == 1
    assert found["made_as"] not in attacked
    assert found["attack"] is None
    assert found["grade"] == "searched"
    assert found["verdict"] == "amber"
    assert not found["closed"]
    assert "it was not attacked itself" in found["status"]
    assert found["may_exceed"] == pytest.approx(1.0, abs=0.1)  # as much as was found on the other
    assert found["worst"] == min(kept["worst"] for kept in found["layouts"].values())
    assert "it was not attacked itself" in (folder / "report.md").read_text()


@pytest.mark.slow
def test_three_are_attacked_though_there_was_one_round(tmp_path, attacked):
    run(tmp_path, rounds=1)
    assert len(set(attacked)) == 3

"""A layout whose first-order condition does not hold gets more evaluations before it is returned."""

import pytest

from tests.sample_layout import STUDY
from workbench.robust_layout import loop as loop_module
from workbench.robust_layout.loop import _Loop
from workbench.stages.campaign import Campaign
from workbench.study.loading import parse_study


def run(folder, text=STUDY):
    path = folder / "two.toml"
    path.write_text(text)
    with Campaign(parse_study(text, path=path)) as campaign:
        return campaign.run()["robust_layout"]


@pytest.fixture
def searches(monkeypatch):
    """Of every optimisation of a loop: how it searched, where it began."""
    made, real = [], loop_module.optimise_for_cases

    def kept(model, cases, *, start, search, **others):
        made.append((search, start))
        return real(model, cases, start=start, search=search, **others)

    monkeypatch.setattr(loop_module, "optimise_for_cases", kept)
    return made


@pytest.mark.slow
def test_the_best_of_all_is_searched_on_where_it_is_not_settled(tmp_path, monkeypatch, searches):
    """Said to be unsettled once, after the rounds."""
    left, attacked_best, longer = [], _Loop.attacked_best, _Loop.longer

    def at_the_end(loop):
        left[:] = [True]
        return attacked_best(loop)

    def seen(loop, name, new):
        before, start = len(searches), loop.judged.layouts[name]
        longer(loop, name, new)
        if left:
            left.pop()
            ((search, begun),) = searches[before:]
            assert search == "binding cases"
            assert begun is start
            assert new in loop.judged.layouts

    monkeypatch.setattr(_Loop, "attacked_best", at_the_end)
    monkeypatch.setattr(_Loop, "is_unsettled", lambda loop, name: bool(left))
    monkeypatch.setattr(_Loop, "longer", seen)
    found = run(tmp_path)
    assert left == []
    assert found["closed"]
    assert found["worst"] <= 1.001 * min(kept["worst"] for kept in found["layouts"].values())


@pytest.mark.slow
def test_rounds_search_with_all_cases_and_other_starts_by_those_that_bind(tmp_path, searches):
    run(tmp_path)
    asked = [search for search, _ in searches]
    assert asked[0] == "all cases"
    assert asked.index("several starts") > asked.index("all cases")

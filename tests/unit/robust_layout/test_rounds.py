"""Where rounds and other starts of a robust loop begin, and when rounds that are left are used."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_layout import STUDY, changed, run
from workbench.robust_layout import loop as loop_module
from workbench.robust_layout.judged import ROUNDS
from workbench.robust_layout.loop import _Loop
from workbench.robust_layout.model import layout_name
from workbench.robust_layout.other_starts import OtherStarts

pytestmark = pytest.mark.slow


def optimised_in(folder, monkeypatch, text=STUDY):
    """The cases, the start and the layout of every optimisation of a loop, and the titles of its starts."""
    made, titles, real = [], [], loop_module.optimise_for_cases

    def kept(model, cases, *, start, **others):
        found = real(model, cases, start=start, **others)
        made.append((cases, start, found.density))
        return found

    def begun(**given):
        titles.extend(given["starts"])
        return OtherStarts(**given)

    monkeypatch.setattr(loop_module, "optimise_for_cases", kept)
    monkeypatch.setattr(loop_module, "OtherStarts", begun)
    run(folder, text)
    return made, titles


def test_rounds_begin_at_the_nominal_layout_and_other_starts_at_that_of_its_worst_case(tmp_path, monkeypatch):
    made, titles = optimised_in(tmp_path, monkeypatch)
    (nominal, none, first), (alone, also_none, second), (several, start, _) = made[:3]
    assert none is None
    assert also_none is None
    assert [case["u"] for case in nominal] == [0.9]
    assert [case["u"] for case in alone] == [-1.0]  # the other end, where that layout is worst
    assert len(several) > 1
    np.testing.assert_array_equal(start, first)
    assert titles == ["second start", "third start", "fourth start"]
    begun = [s for cases, s, _ in made[3:] if s is not None and np.array_equal(s, second)]
    assert begun  # by the layouts from other starts


def test_a_single_case_has_no_worst_of_the_others(tmp_path, monkeypatch):
    made, titles = optimised_in(tmp_path, monkeypatch, changed("scenarios = 4", "scenarios = 0"))
    assert titles == ["third start", "fourth start"]
    assert made[1][1] is not None


def test_rounds_that_are_left_are_used_where_the_best_layout_breaks_in_the_end(tmp_path, monkeypatch):
    attacked_best, rounds = _Loop.attacked_best, []

    def broken_at_first(loop):
        name = attacked_best(loop)
        if not rounds:  # as where the attack on another layout finds a case for it
            loop.bounds[name] *= 0.5
        rounds.append(len(loop.rounds))
        return name

    monkeypatch.setattr(_Loop, "attacked_best", broken_at_first)
    found, _ = run(tmp_path)
    assert rounds[0] < 5
    assert rounds[1] > rounds[0]
    assert len(found["rounds"]) == rounds[-1]
    assert found["closed"] or rounds[-1] == 5


def test_one_that_stands_is_attacked_before_another_is_made(tmp_path, monkeypatch):
    """The first round makes two layouts as good; the better one breaks, and the other holds."""
    improved, keep = _Loop.improved, _Loop.keep

    def two(loop, number):
        made = improved(loop, number)
        if number == 1:
            name = "round 1, another"
            loop.judged.layouts[name] = loop.judged.layouts["round 1"] * (1 - 1e-4)
            loop.judged.documents[name] = {**loop.judged.documents["round 1"], "purified": None}
            loop.judged.origins[name], loop.judged.known[name] = ROUNDS, len(loop.judged.cases)
        return made

    def broken(loop, name, found):
        if name == "round 1":
            case, value = loop.judged.cases[0], 1.5 * found.value
            loop.judged._answers[layout_name(loop.judged.layouts[name])][repr(sorted(case.items()))] = value
            found = replace(found, value=value, case=case)
        return keep(loop, name, found)

    monkeypatch.setattr(_Loop, "improved", two)
    monkeypatch.setattr(_Loop, "keep", broken)
    found, _ = run(tmp_path)
    first, second = found["rounds"][:2]
    assert (first["layout"], second["layout"]) == ("round 1", "round 1, another")
    assert (second["cases"], second["attacked"]) == (0, True)
    assert second["note"].startswith("none is made, the best is as good in all cases")
    assert found["closed"]

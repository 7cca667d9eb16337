"""Layouts from other starts: made until one agrees with the best, and judged over all cases at the end."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.sample_layout import TwoMembers
from workbench.models.evaluator import Outcome
from workbench.robust_layout.cases import Optimised
from workbench.robust_layout.judged import ROUNDS, JudgedLayouts
from workbench.robust_layout.other_starts import OtherStarts, random_densities
from workbench.robust_layout.record import passed_over

CASES = [{"u": 0.0}, {"u": 1.0}]


def height(density, u):
    """Local minima at densities 1, 2 and 3, of heights 10, 8 and 8.1; in the case u = 1 the third is 9, in
    the case u = 2 they are 9 and 9.5."""
    end = round(float(density[0]))
    heights = {0: (10.0, 8.0, 8.1), 1: (10.0, 8.0, 9.0), 2: (10.0, 9.0, 9.5)}[round(u)]
    return heights[end - 1] + abs(float(density[0]) - end)


def judged(cases=CASES):
    def evaluator(density):
        return lambda rows, purpose: [
            Outcome(parameters=row, status="ok", outputs={"y": height(density, row["u"])}) for row in rows
        ]

    return JudgedLayouts(
        evaluator=evaluator, model=SimpleNamespace(response="y"), cases=[dict(case) for case in cases]
    )


def layout(place):
    return Optimised(density=np.array([place]), document={"status": "CONVERGED"})


def starts(layouts, ends, said=None):
    """Other starts that end where `ends` says, one after the other; None where it cannot be made."""
    left = iter(ends)

    def optimised(best, start, search):
        end = next(left)
        return None if end is None else layout(end)

    return OtherStarts(
        judged=layouts, optimised=optimised, tolerance=0.02, tell=[].append if said is None else said.append,
        starts={"second start": None, "third start": np.array([1.5]), "fourth start": np.array([2.5])},
    )  # fmt: skip


def test_a_start_that_agrees_ends_the_matter():
    layouts, said = judged(), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [2.1], said)
    assert others.agree()
    assert said == ["the layout from the second start"]
    found = others.found()
    assert (found.worst, found.agrees, found.starts) == (8.1, True, (ROUNDS, "second start"))
    assert found.apart == pytest.approx(0.1 / 8)
    assert others.agree()  # nothing has joined: nothing is made again
    assert len(said) == 1


def test_one_that_is_worse_is_continued_and_others_are_tried():
    layouts, said = judged(), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [1.4, 1.0, 2.4, 2.05], said)
    assert others.agree()
    assert said == [
        "the layout from the second start", "the layout from the second start, continued 1",
        "the layout from the third start", "the layout from the third start, continued 1",
    ]  # fmt: skip
    assert list(layouts.layouts)[1:3] == ["second start", "second start, continued 1"]
    assert others.found().agrees


def test_one_whose_gains_could_bring_it_to_the_best_is_continued_to_the_end():
    layouts, said = judged(), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    assert starts(layouts, [2.49, 2.2, 2.1], said).agree()
    assert said[-1] == "the layout from the second start, continued 2"


def test_starts_that_all_end_elsewhere_do_not_agree():
    layouts = judged()
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [1.0, 1.0, 1.1, 1.1, 3.0, 3.0])
    assert not others.agree()
    found = others.found()
    assert not found.agrees
    assert found.worst == 9.0
    assert found.apart == pytest.approx(1 / 8)


def test_a_case_that_breaks_the_other_alone_says_nothing_of_the_best():
    layouts = judged(CASES[:1])
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [3.0])
    assert others.agree()  # 8.1 and 8 in the first case
    layouts.join(CASES[1:])
    assert layouts.worst("second start") == 9.0
    found = others.found()
    assert (found.worst, found.cases, found.agrees) == (8.1, 1, True)
    assert found.apart == pytest.approx(0.1 / 8)
    assert others.agrees()


def test_a_case_that_raises_the_best_beyond_what_another_start_promises_decides_again():
    layouts = judged(CASES[:1])
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [3.0, 2.0])
    assert others.agree()
    layouts.join([{"u": 2.0}])
    assert others.found().apart == pytest.approx(0.5 / 9)  # 9.5 and 9; it was 8.1 before, a tenth below
    assert not others.agrees()
    assert others.agree()  # by the layout that goes on from the second start
    assert others.agrees()


def test_the_first_search_of_a_start_is_the_wider_one():
    layouts, asked = judged(), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [2.49, 2.2, 2.1])
    made = others.optimised
    others.optimised = lambda best, start, search: asked.append(search) or made(best, start, search)
    assert others.agree()
    assert asked == ["several starts", "binding cases", "binding cases"]


def test_one_start_has_the_wide_search_and_the_others_one_of_their_own():
    layouts, asked = judged(), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [1.0, 1.1, 1.0, 1.1, 1.0, 1.1])
    made = others.optimised
    others.optimised = lambda best, start, search: asked.append(search) or made(best, start, search)
    assert not others.agree()
    assert asked == [
        "several starts", "binding cases", "one start", "binding cases", "one start", "binding cases",
    ]  # fmt: skip


def test_a_layout_that_stays_the_same_is_kept_once_and_names_go_on_as_they_were_told():
    layouts, said = judged(CASES[:1]), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [2.4, 2.4 + 1e-9, 2.3, 2.05, None, None], said)
    others.starts = {"second start": None}
    assert not others.agree()
    assert said[-1] == "the second start, continued 1: the layout is the same as before"
    assert list(layouts.layouts) == ["round 1", "second start"]
    assert others.agree()  # as where cases have joined
    assert said[-2:] == [
        "the layout from the second start, continued 2", "the layout from the second start, continued 3",
    ]  # fmt: skip
    assert list(layouts.layouts)[2:] == ["second start, continued 2", "second start, continued 3"]


def test_purified_forms_are_not_counted_as_turns():
    clean = {"accepted": True, "value": 8.4, "before": 8.4, "density": [2.42]}
    layouts, said = judged(CASES[:1]), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others, ends = starts(layouts, [], said), iter([2.4, 2.2, 2.1])
    others.starts = {"second start": None}
    others.optimised = lambda best, start, search: Optimised(
        density=np.array([next(ends)]), document={"purified": clean}
    )
    assert others.agree()
    assert said[-1] == "the layout from the second start, continued 2"
    assert "second start, continued 2" in layouts.layouts
    assert "second start, purified" in layouts.layouts


def test_all_starts_are_other_ones_than_that_of_a_trivial_layout():
    layouts = judged()
    layouts.add("round 1", layout(2.5), origin=ROUNDS)
    layouts.add("second start", layout(1.0), origin="second start")
    layouts.layouts["uniform"] = layout(2.0).density
    assert starts(layouts, []).found().worst == 10.0  # beside the best of those that were made
    found = starts(layouts, []).found("uniform")
    assert (found.worst, found.agrees) == (8.5, False)  # the nearest of all that were made
    assert found.apart == pytest.approx(0.5 / 8)


def test_a_better_one_needs_another_that_agrees_with_it():
    layouts = judged()
    layouts.add("round 1", layout(1.0), origin=ROUNDS)
    others = starts(layouts, [2.0, 2.0, 1.0, 1.0, 1.0, 1.0])
    assert not others.agree()
    assert others.found().worst == 10.0
    layouts.add("round 2", layout(2.0), origin="second start")  # from the best: no witness of its own
    assert not others.found().agrees
    assert starts(layouts, [2.0, 2.0, 2.0]).agree()


def test_a_layout_that_cannot_be_made_is_no_witness():
    layouts = judged()
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [None, None, None])
    assert not others.agree()
    assert others.found() is None


def test_one_start_is_made_when_the_rounds_are_spent():
    layouts, said = judged(), []
    layouts.add("round 1", layout(2.0), origin=ROUNDS)
    others = starts(layouts, [1.0, 1.1], said)
    others.first()
    assert len(said) == 2
    others.first()
    assert len(said) == 2


def test_random_densities_keep_the_budget_and_are_those_of_the_seed():
    problem = TwoMembers(budget=0.7).problem([{"u": 0.5, "v": 0.0}])
    drawn = random_densities(problem, seed=4)
    assert drawn.sum() <= 0.7 + 1e-12
    assert drawn.min() >= 0.0
    np.testing.assert_array_equal(drawn, random_densities(problem, seed=4))
    assert not np.allclose(drawn, random_densities(problem, seed=5))


def test_a_layout_that_holds_is_left_only_for_a_gain_that_is_worth_an_attack():
    layouts = judged()
    layouts.add("round 1", layout(2.018), origin=ROUNDS)
    layouts.add("second start", layout(2.0), origin="second start")
    layouts.add("third start", layout(2.1), origin="third start")
    assert layouts.best() == "second start"
    assert layouts.best(rather=["round 1"]) == "second start"
    assert layouts.best(rather=["round 1", "third start"], within=0.01) == "round 1"
    assert layouts.best(rather=["round 1"], within=0.001) == "second start"
    assert layouts.best(rather=["third start"], within=0.01) == "second start"


def test_no_layout_is_left_worse_than_one_that_nobody_searched():
    layouts = judged()
    layouts.add("round 1", layout(2.018), origin=ROUNDS)
    layouts.layouts["uniform"] = layout(2.01).density
    assert layouts.best(rather=["round 1"], within=0.01) == "uniform"


def test_a_purified_form_that_is_the_layout_again_is_no_other_layout():
    layouts = judged()

    def made(place, pure):
        clean = {"accepted": True, "value": 8.0, "before": 8.0, "density": [pure]}
        return Optimised(density=np.array([place]), document={"purified": clean})

    assert layouts.add("round 1", made(2.0 + 4e-9, 2.0), origin=ROUNDS) == ["round 1"]
    assert layouts.add("round 2", made(2.1, 2.0), origin=ROUNDS) == ["round 2", "round 2, purified"]
    assert layouts.best() == "round 2, purified"
    assert (
        passed_over("round 2, purified", layouts.worst, "round 1") == ""
    )  # it is the same by another search
    assert "'round 2, purified' is 1.25 % lower" in passed_over("round 2, purified", layouts.worst, "round 2")


def test_a_layout_that_is_passed_over_is_told():
    worst = {"round 1": 2.0, "round 2": 1.99}.__getitem__
    assert passed_over("round 2", worst, "round 1") == (
        " In the cases known the layout 'round 2' is 0.503 % lower, less than half of the tolerance; "
        "returned is the one that withstood an attack."
    )
    assert passed_over("round 2", worst, "round 2") == ""

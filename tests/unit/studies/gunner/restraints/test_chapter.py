"""The layouts of section 8.6: what is open, what is kept, what is said of them; one is found (slow)."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.gunner.cases import Case
from studies.gunner.restraints.chapter import SAID, Found, agreement, figures, find, lines, shares
from studies.gunner.restraints.designs import (
    DESIGNS,
    RETRACTORS,
    layout_problem,
    members,
    places,
    value_of,
)

BY_NAME = {design.name: design for design in DESIGNS}


def of(name, chosen):
    """A layout of full members where `chosen` says so."""
    some = places(BY_NAME[name])
    result = SimpleNamespace(evaluations=3, status=SimpleNamespace(name="LIMIT"))
    return Found(
        design=BY_NAME[name], places=some, density=np.array([float(chosen(p)) for p in some]), nothing=0.3,
        uniform=0.2, value=0.1, finer=0.1, error=0.01, result=result,
    )  # fmt: skip


def test_what_the_text_says_is_held_against_a_layout():
    as_printed = of("(8.34)", lambda p: (p.at, p.site.side, p.site.segment) == (1.5, "left", "upper torso"))
    assert [agrees for _, _, agrees in agreement(as_printed)] == [True, True, True]
    other = of("(8.34)", lambda p: p.site.side == "left")
    assert agreement(other) == [
        ("all fire at 1.5 s", pytest.approx(1 / 3), False), ("on the left side", 1.0, True),
        ("on the upper torso", pytest.approx(1 / 3), False),
    ]  # fmt: skip
    most = of("(8.33)", lambda p: (p.kind, p.site.side) in (("belt", "back"), ("airbag", "front")))
    said = dict((words, agrees) for words, _, agrees in agreement(most))
    assert said["belts at the back most"]
    assert said["airbags in front most"]
    assert not said["belts in the highest layer"]


def test_nothing_left_agrees_with_no_sentence():
    assert not any(agrees for _, _, agrees in agreement(of("(8.33)", lambda p: p.kind == "belt"))[2:])
    assert set(SAID) == set(BY_NAME)


def test_shares_are_of_the_sum_and_lines_tell_them():
    found = of("(8.32)", lambda p: p.kind == "belt" and p.site.layer == 1)
    assert shares(found, lambda p: p.site.layer) == {1: 1.0}
    assert shares(found, lambda p: p.site.side, "airbag") == {}
    told = lines(found)
    assert told[0].startswith("(8.32) braking  largest g1 0-1 s  none 0.3000  uniform 0.2000  ours 0.1000")
    assert told[1].startswith("    belt: sum 36.00; layer 1 100 %; ")
    assert told[3].split() == ["text:", "belts", "alone", "ours", "100.0", "%", "agrees"]
    (axes,) = [figure.axes for figure in figures({"(8.32)": found}).values()]
    assert [ax.get_title() for ax in axes] == ["(8.32) belts", "(8.32) airbags"]


def test_members_act_when_the_text_says():
    problem = layout_problem(BY_NAME["(8.37)"], step=5e-2)
    assert problem.geometry.kind == ("airbag",) * 180
    parts = members(Case(), places(BY_NAME["(8.37)"])[:2] + places(BY_NAME["(8.36)"])[:1]).members
    assert [getattr(m.law, "deploy", None) or m.law.t0 for m in parts] == [2.0, 2.0, 1.7]
    design = BY_NAME["(8.34)"]
    assert [p.at for p in places(design)][::36] == [1.5, 1.6, 1.7]
    assert value_of(design, 1.0) == pytest.approx(0.23)
    assert value_of(BY_NAME["(8.37)"], 0.09) == pytest.approx(0.3)


def test_what_is_kept_stands_behind_what_is_open_and_does_not_move():
    belts = places(BY_NAME["(8.29)"])
    density = np.zeros(len(belts))
    density[[3, 50]] = 1.0, 0.4
    problem = layout_problem(BY_NAME["(8.31)"], (belts, density), step=5e-2)
    assert problem.members == 36 + 2
    assert problem.lower[36:].tolist() == problem.upper[36:].tolist() == [1.0, 0.4]
    assert problem.usage(problem.start)[0] == pytest.approx(1.0)  # the kept ones cost nothing more
    assert problem.limits[0] == RETRACTORS


@pytest.mark.slow
def test_retractors_at_three_times_are_all_taken_early():
    """(8.34), as the text says; the layout lowers him by more than a metre, to its first-order optimum."""
    seen = []
    found = find([BY_NAME["(8.34)"]], evaluations=15, seen=seen.append)["(8.34)"]
    assert seen == [found]
    assert shares(found, lambda p: p.at) == {1.5: 1.0}
    assert found.nothing == pytest.approx(0.987, abs=2e-3)
    assert found.value < -0.4
    assert found.finer == pytest.approx(found.value, abs=5e-3)
    assert found.error < 0.02
    assert found.density.sum() == pytest.approx(RETRACTORS)


def test_a_design_that_keeps_one_that_was_not_asked_for_is_refused():
    with pytest.raises(KeyError, match=r"\(8.29\)"):
        find([BY_NAME["(8.31)"]])

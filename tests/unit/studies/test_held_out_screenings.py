"""Counts over functions and decks on which no rule of the screening was chosen."""

import numpy as np
import pytest

from studies.held_out_functions import COMPOSED, PUBLISHED, composed_function, held_out
from studies.held_out_screenings import Listing, counted, main, of_deck, of_function
from studies.screening_lists import jansen_indices


def listing(state, selected, *, x=0.01, apart=(), **totals):
    return Listing(state=state, x=x, selected=frozenset(selected), apart=frozenset(apart), totals=totals)


def test_what_is_counted():
    totals = {"a": 0.7, "b": 0.2, "c": 0.06, "d": 0.009}
    right = listing("resolved", "abc", **totals)
    crumb = listing("resolved", "abcd", **totals)
    short = listing("resolved", "ab", x=0.1, **totals)
    open_ = listing("partly resolved", "ab", x=0.05, apart="c", **totals)
    hidden = listing("not resolved", "a", x=0.05, **totals)
    found = counted([(right, crumb), (right, right), (short, open_), (hidden, right)])
    assert (found.screenings, found.resolved, found.pairs, found.agree) == (8, 6, 2, 1)
    # of those resolved one holds d, one lacks c; b and c are above what `hidden` allows for
    assert (found.crumbs, found.missing, found.beyond) == (1, 1, 1)
    assert found.x == 0.01
    assert "agree 1 of 2" in str(found)


def test_the_functions_are_those_of_their_sources():
    # Morris, Moore and McKay: five alike inputs act, ten do not
    total = jansen_indices(held_out("morris"))
    assert total[:5] == pytest.approx(total[0], abs=0.005)
    assert (total[5:] == 0.0).all()
    # Branin's three minima
    minima = np.array([[-np.pi, 12.275], [np.pi, 2.275], [9.42478, 2.475]])
    at = np.hstack([(minima + np.array([5, 0])) / 15, np.zeros((3, 6))])
    assert held_out("branin").evaluate(at) == pytest.approx(0.397887, abs=1e-5)
    # equal masses and springs: w = 2 sqrt(k/m) sin(pi/14)
    middle = np.full((1, 9), 0.5)
    assert held_out("chain").evaluate(middle)[0] == pytest.approx(20 * np.sin(np.pi / 14))
    # Dixon and Price's minimum is zero
    z = 2.0 ** -(1 - 0.5 ** np.arange(5)) * np.ones(5)
    assert held_out("dixon-price").evaluate(np.append((z + 2) / 4, np.zeros(4))[None])[0] < 1e-20


def test_each_function_is_finite_and_a_seed_gives_it_again():
    for name in (*PUBLISHED, *COMPOSED):
        f = held_out(name)
        y = f.evaluate(np.random.default_rng(0).random((200, f.d)))
        assert y.shape == (200,)
        assert np.isfinite(y).all()
        assert y.std() > 0
    points = np.random.default_rng(1).random((5, composed_function(3).d))
    np.testing.assert_array_equal(
        composed_function(3).evaluate(points), held_out("composed 3").evaluate(points)
    )
    assert len({composed_function(seed).d for seed in range(12)}) > 3


def test_a_word_that_is_neither_is_refused():
    with pytest.raises(SystemExit, match="needs functions or decks, got 'other'"):
        main(["other", "0", "4"])
    with pytest.raises(SystemExit, match="decks are buck, amplifier, bracket, got 'branin'"):
        main(["decks", "0", "4", "branin"])


@pytest.mark.slow
def test_two_designs_of_a_function_and_of_a_deck():
    first, second = of_function("roof truss", 0, 0.0)
    assert first.is_resolved
    assert first.selected == second.selected == {f"x{k}" for k in range(1, 7)}
    found = counted([of_deck("buck", "ripple", 0, 0.0)])
    assert found.missing == found.beyond == 0

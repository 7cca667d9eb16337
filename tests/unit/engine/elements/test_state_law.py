"""Laws with states of the user's: what is taken, what is refused."""

import math
import pickle

import numpy as np
import pytest

from workbench.engine import StateLaw


def force(delta, rate, t, x, y, k, c):
    return k * (delta - x) ** 3 + c * rate * y + t


def growth(delta, rate, t, x, y, k, c):
    return (delta - x) * k / c, rate - y


LAW = StateLaw(force=force, growth=growth, states={"x": 0.1, "y": 0.2}, constants={"c": 5.0, "k": 40.0})


def test_force_and_growth_are_those_of_the_functions():
    found = LAW.look(-0.3, 0.5, 0.2, (0.1, 0.4))
    expected = [force(-0.3, 0.5, 0.2, 0.1, 0.4, 40.0, 5.0), *growth(-0.3, 0.5, 0.2, 0.1, 0.4, 40.0, 5.0)]
    np.testing.assert_allclose(found.real, expected, rtol=1e-14)


def test_constants_stand_in_the_order_of_the_functions_and_starts_can_be_changed():
    assert tuple(LAW.constants) == ("k", "c")
    moved = LAW.changed(x=0.5, k=1.0)
    assert (dict(moved.states), dict(moved.constants)) == ({"x": 0.5, "y": 0.2}, {"k": 1.0, "c": 5.0})
    with pytest.raises(ValueError, match="no state or constant is called 'q': x, y, k, c"):
        LAW.changed(q=1.0)
    with pytest.raises(ValueError, match="a law with states needs numbers, got x=nan"):
        LAW.changed(x=float("nan"))


def test_one_law_survives_pickling():
    again = pickle.loads(pickle.dumps(LAW))
    assert again == LAW
    assert again.addresses() == LAW.addresses()


def plain(delta, rate, t, x):
    return x * delta


def rate_of(delta, rate, t, x):
    return rate - x


def kinked(delta, rate, t, x):
    return rate - abs(x) * x


def with_math(delta, rate, t, x):
    return math.sin(x)


def two(delta, rate, t, x):
    return rate, x


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"states": {}}, "1 to 2 states and at most 22 constants, got 0 and 0"),
        ({"states": {"x": 0.0, "y": 0.0, "z": 0.0}}, "got 3 and 0"),
        ({"states": {"x": math.inf}}, "needs numbers, got x=inf"),
        ({"constants": {"k": 1.0}}, r"needs force\(delta, rate, t, x, k\), got plain\(delta, rate, t, x\)"),
        ({"growth": kinked}, r"'kinked' of a law has a slope by x of .* by complex step at x="),
        ({"growth": with_math}, "does not compile 'plain' and 'with_math' of a law.*sin"),
        ({"growth": two}, "(?s)does not compile .*growth returns as many numbers as there are states"),
    ],
)
def test_what_cannot_be_a_law_is_refused(changed, message):
    given = {"force": plain, "growth": rate_of, "states": {"x": 0.0}, **changed}
    with pytest.raises(ValueError, match=message):
        StateLaw(**given)

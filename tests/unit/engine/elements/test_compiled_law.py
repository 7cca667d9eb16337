"""Laws that users write as functions and numba compiles: what is taken, what is refused, what slopes are."""

import math
import pickle

import numpy as np
import pytest

from workbench.engine import (
    CompiledLaw,
    InvalidSystem,
    NaturalPoint,
    NaturalSystem,
    PointMember,
    UserLaw,
    simulate,
)
from workbench.engine.elements.law_series import law_series
from workbench.engine.layout.formulation.law_variables import LawVariable


def stiffening(delta, rate, t, k, n, c):
    return k * (1.0 + delta) ** n + c * rate**3 + delta**-2 * t


def by_hand(delta, k, n, c, rate, t):
    return (
        k * n * (1.0 + delta) ** (n - 1.0) - 2.0 * delta**-3 * t,
        3.0 * c * rate**2,
    )


def look(law, delta, rate=0.0, t=0.0):
    series = law_series([law], np.array([[delta]]), np.array([[rate]]), np.array([t]))
    return tuple(float(column[0, 0]) for column in series)


LAW = CompiledLaw(force=stiffening, constants={"c": 3.0, "k": 20.0, "n": 2.5})


@pytest.mark.parametrize("delta", [-0.4, -0.01, 0.02, 0.7])
def test_slopes_by_complex_step_are_those_by_hand_whatever_the_signs(delta):
    f, by_delta, by_rate, energy = look(LAW, delta, -0.7, 0.3)
    assert f == pytest.approx(stiffening(delta, -0.7, 0.3, 20.0, 2.5, 3.0), rel=1e-14)
    assert (by_delta, by_rate) == pytest.approx(by_hand(delta, 20.0, 2.5, 3.0, -0.7, 0.3), rel=1e-13)
    assert energy == 0.0


def test_whole_powers_of_negative_numbers_keep_their_slopes():
    """numba's own complex power loses them: its angle of a negative number is pi, rounded."""

    def cube(delta, rate, t):
        out = delta
        out **= 3
        return out + delta**3.0 + delta**-1

    _, by_delta, _, _ = look(CompiledLaw(force=cube), -0.5)
    assert by_delta == pytest.approx(2 * 3 * 0.25 - 4.0, rel=1e-14)


def test_constants_stand_in_the_order_of_the_function():
    assert tuple(LAW.constants) == LAW.names[-3:] == ("k", "n", "c")
    assert LAW.parameters[-3:] == (20.0, 2.5, 3.0)


def test_functions_made_again_are_compiled_once():
    def made():
        return CompiledLaw(force=lambda delta, rate, t, k: k * delta, constants={"k": 2.0})

    assert made().parameters == made().parameters


def test_what_a_function_reads_of_its_module_is_never_stale():
    module = {"k": 2.0, "table": np.array([1.0, 5.0])}
    exec("def half(x): return 0.5 * k * x\ndef force(delta, rate, t): return half(delta) + table[1]", module)

    def at_one():
        return look(CompiledLaw(force=module["force"]), 1.0)[0]

    assert at_one() == 6.0
    module["k"] = 4.0
    assert at_one() == 7.0
    module["table"][1] = 6.0
    assert at_one() == 8.0
    exec("def half(x): return k * x", module)
    assert at_one() == 10.0


def test_one_law_survives_pickling():
    again = pickle.loads(pickle.dumps(LAW))
    assert again == LAW
    assert again.parameters == LAW.parameters


def test_constants_can_be_design_variables():
    variable = LawVariable(name="k", members=(0,), parameter="k", lower=1.0, upper=30.0)
    assert variable.moved(LAW, 7.0) == LAW.changed(k=7.0)


def test_several_laws_stand_side_by_side_in_one_system():
    one = CompiledLaw(force=lambda delta, rate, t, k: k * delta, constants={"k": 2.0})
    two = CompiledLaw(force=lambda delta, rate, t: np.sin(delta))
    delta, none = np.array([[0.3, 0.3, 0.3]]), np.zeros((1, 3))
    force = law_series([one, two, one.changed(k=4.0)], delta, none, np.zeros(1)).force[0]
    np.testing.assert_allclose(force, [0.6, np.sin(0.3), 1.2], rtol=1e-15)


def capturing():
    k = 3.0
    return lambda delta, rate, t: k * delta


def magnitude(delta, rate, t):
    return abs(delta) * delta


def with_math(delta, rate, t):
    return math.exp(delta)


def larger(delta, rate, t):
    return max(delta, 0.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"force": capturing()}, "reads 'k' of the function around it"),
        ({"force": magnitude}, r"slope by delta of 0.3137 by complex step at delta=-0.3137.*give 0.6274"),
        ({"force": with_math}, r"does not compile 'with_math' of a law: No impl.*exp"),
        ({"force": larger}, r"(?s)does not compile 'larger' of a law.*or give slopes"),
        (
            {"force": larger, "slopes": lambda delta, rate, t: (1.0, 0.0)},
            r"slope by delta of 1 as given at delta=-0.3137.*differences give 0; correct slopes",
        ),
        ({"force": lambda delta, rate: delta}, r"needs force\(delta, rate, t\), got <lambda>\(delta, rate\)"),
        (
            {"force": stiffening, "constants": {"k": 1.0, "n": 2.0}},
            r"needs force\(delta, rate, t, k, n\), got stiffening\(delta, rate, t, k, n, c\)",
        ),
        (
            {
                "force": lambda delta, rate, t, a, b: a * delta + b,
                "slopes": lambda delta, rate, t, b, a: (a, 0.0),
                "constants": {"a": 1.0, "b": 2.0},
            },
            "force and slopes of a compiled law need their arguments in one order",
        ),
        ({"force": np.sin}, "needs a function of Python as force, got ufunc"),
        ({"force": larger, "constants": {"k": math.nan}}, "needs numbers, got k=nan"),
        ({"force": larger, "constants": {f"k{i}": 1.0 for i in range(27)}}, "at most 26 constants, got 27"),
    ],
)
def test_what_cannot_be_a_law_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        CompiledLaw(**given)


def test_unknown_constants_are_refused():
    with pytest.raises(ValueError, match="no constant is called 'q': k, n, c"):
        LAW.changed(q=1.0)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_constant_is_not_changed_to_what_is_no_number(value):
    with pytest.raises(ValueError, match=f"a compiled law needs numbers, got k={value}"):
        LAW.changed(k=value)


def test_a_kink_at_rest_passes_with_slopes():
    law = CompiledLaw(force=larger, slopes=lambda delta, rate, t: (1.0 if delta > 0.0 else 0.0, 0.0))
    assert look(law, 0.2)[:3] == (0.2, 1.0, 0.0)
    assert law.names == ("", "", "", "")


def test_natural_coordinates_name_what_to_use_in_place_of_a_law_in_python():
    points = (
        NaturalPoint(name="m", position=(0.0, 0.0, 0.0), mass=2.0),
        NaturalPoint(name="p", position=(1.0, 0.0, 0.0), fixed=True),
    )
    member = PointMember(a="m", b="p", law=UserLaw(force=lambda delta, rate, t: delta))
    with pytest.raises(InvalidSystem, match=r"members\[0\] has a UserLaw.*use CompiledLaw"):
        simulate(NaturalSystem(points=points, members=(member,)), [1.0], 0.1, 10)

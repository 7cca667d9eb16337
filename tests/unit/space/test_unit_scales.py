"""Units that a header names: which are known, and which clearly differ from the study's."""

import pytest

from workbench.space.unit_scales import contradiction, scale_of, unit_in_header, without_unit

SAME = [
    ("kg m/s^2", "N"),
    ("N m", "Nm"),
    ("N·m", "N m"),
    ("N/mm^2", "MPa"),
    ("N/mm²", "MPa"),
    ("kg m²/s³", "W"),
    ("1/s", "Hz"),
    ("s^-1", "Hz"),
    ("kN/mm", "MN/m"),
    ("N m/rad", "N m"),
    ("rad/s", "1/s"),
    ("deg", "°"),
    ("N/(m s)", "N/(s m)"),
    ("l", "dm^3"),
]


@pytest.mark.parametrize(("a", "b"), SAME)
def test_spellings_of_one_unit_do_not_contradict(a, b):
    (left, size), (right, other) = scale_of(a), scale_of(b)
    assert left == right
    assert size == pytest.approx(other, rel=1e-12)
    assert not contradiction(f"x [{a}]", b)
    assert not contradiction(f"x ({b})", a) or "(" in a


DIFFERENT = [
    ("mass [g]", "kg"),
    ("mass [N]", "kg"),
    ("gap (mm)", "m"),
    ("gap [in]", "mm"),
    ("angle [deg]", "rad"),
    ("speed [km/h]", "m/s"),
    ("stress [MPa]", "Pa"),
    ("p [psi]", "bar"),
    ("k [N/mm]", "N/m"),
    ("gap_mm", "m"),
    ("F_kN", "N"),
    ("angle_deg", "rad"),
    ("n [rpm]", "1/s"),
    ("n [rpm]", "Hz"),
]


@pytest.mark.parametrize(("column", "unit"), DIFFERENT)
def test_clear_contradictions(column, unit):
    assert contradiction(column, unit)


OPEN = [
    ("mass [kg]", "kg"),
    ("mass", "kg"),
    ("mass [kg]", "1"),  # the study says none
    ("load (max)", "N"),
    ("load [new]", "N"),
    ("T [°C]", "K"),  # nobody here knows °C
    ("price [EUR]", "kEUR"),
    ("v_ms", "m/s"),
    ("x_m", "mm"),  # the mean, perhaps
    ("load_max", "N"),
    ("flow_in", "kg/s"),
    ("run [1]", "N"),  # a number
    ("mass [kg] old", "g"),
    ("n [rpm]", "1/min"),  # of turns
    ("n [1/min]", "rpm"),
    ("T [min^-1]", "rpm"),
]


@pytest.mark.parametrize(("column", "unit"), OPEN)
def test_what_is_not_clear_is_left_alone(column, unit):
    assert not contradiction(column, unit)


def test_units_are_read_off_the_end():
    assert unit_in_header("S_max [MPa]") == "MPa"
    assert without_unit("S_max [MPa]") == "S_max"
    assert unit_in_header("S_max") is None
    assert scale_of("N/m/s") is None  # of two readings
    assert scale_of("") is None

"""The file of numbers: read into typed records, each slip told once with its place."""

import pytest

from studies.gunner.parameters import FILE, SOURCES, InvalidNumber, read, rows
from studies.gunner.vehicle.numbers import VehicleParameters


def test_every_number_has_a_unit_and_a_source_and_is_read():
    parameters = read(VehicleParameters, "vehicle")
    assert parameters.masses.total == 2821.0
    assert parameters.tyre.lateral[0] == pytest.approx(1.49975, abs=1e-5)
    table = rows()
    assert {row.name for row in table} >= {"vehicle.front.anti_roll", "vehicle.steering.ratio"}
    assert all(row.unit and row.source in SOURCES for row in table)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "swing_arm = {",
            "swing_arn = {",
            r"\[vehicle.front\] knows no 'swing_arn'; did you mean 'swing_arm'",
        ),
        ("lock = {", "# lock = {", r"\[vehicle.steering\] lacks 'lock'"),
        ("[vehicle.masses]", "[vehicle.masses]\nzzz = 1", r"knows no 'zzz'; it has total, centre"),
        ('value = 16.0, unit = "1"', 'value = 16.0, unit = "deg"', r"wanted in '1', got unit 'deg'"),
        ("value = 16.0,", "value = -16.0,", r"vehicle.steering.ratio must be more than 0 1, got -16.0"),
        ("value = 20000.0,", "value = -1.0,", r"anti_roll must be at least 0 N m/rad, got -1.0"),
        ("value = 16.0,", 'value = "16",', r"vehicle.steering.ratio needs a number, got 16"),
        ("value = [-1.69, -0.0005, 0.77],", "value = [-1.69, 0.77],", r"masses.centre needs 3 numbers, got"),
        ('source = "dissertation"', 'source = "hearsay"', r"needs a source among dissertation, .*'hearsay'"),
        ('total = { value = 2821.0, unit = "kg",', "total = { amount = 2821.0,", r"total needs \{ value = "),
        ("[vehicle.", "[lorry.", r"has no table \[vehicle\]"),
    ],
)
def test_slips_are_told_with_their_place(tmp_path, old, new, message):
    text = FILE.read_text()
    assert old in text
    path = tmp_path / "own.toml"
    path.write_text(text.replace(old, new))
    with pytest.raises(InvalidNumber, match=message):
        read(VehicleParameters, "vehicle", path)

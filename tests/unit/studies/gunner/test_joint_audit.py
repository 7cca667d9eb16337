"""The audit of the joints: on functions whose shares are known, and one corner of the gunner himself."""

import numpy as np
import pytest

from studies.gunner.checks.joint_audit import audit, lines, rise, row_of, shares
from studies.gunner.figure_numbers import JOINTS


def known(point):
    """Shares of the corners: 64/85 by the first, 16/85 by the third, 4/85 by both, 1/85 by the second."""
    x = np.asarray(point)
    return float(8.0 * x[0] + x[1] + 4.0 * x[2] + 2.0 * x[0] * x[2])


def test_shares_of_the_corners_are_those_of_the_polynomial():
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 4, indexing="ij")).reshape(4, -1).T
    found = shares(np.array([known(corner) for corner in corners]))
    assert found.main == pytest.approx(np.array([64.0, 1.0, 16.0, 0.0]) / 85.0)
    assert found.total == pytest.approx(np.array([68.0, 1.0, 20.0, 0.0]) / 85.0)
    assert found.effect == pytest.approx([16.0, 2.0, 8.0, 0.0])


def test_three_ways_agree_where_the_function_is_plain():
    found = audit(known, 4, runs=40)
    assert found.base == 0.0
    assert found.single == pytest.approx(np.array([[-8.0, 8.0], [-1.0, 1.0], [-4.0, 4.0], [0.0, 0.0]]))
    assert set(found.selected) >= {0, 2}
    assert 3 not in found.selected


def test_the_table_has_a_row_for_every_joint_and_a_path():
    found = audit(lambda point: known(point[:4]), len(JOINTS), runs=24)
    told = lines(found)
    assert [line.split()[1] for line in told[2:10]] == list(JOINTS)
    assert told[2].split()[2:] == ["-8000.000", "8000.000", "16000.000", "75.29", "80.00"]
    assert told[10].startswith("order one at a time 1,3,2,")
    for line, step in zip(told[11:], found.printed_path, strict=True):  # in the form of Table 8.7
        assert line.strip("[]").split("(")[0].strip() == ",".join(str(j + 1) for j in step.selected)


def test_rows_are_factors_and_one_corner_lifts_him():
    assert row_of([1.0, 0.0, -1.0, *[0.0] * 5])["k_elbow"] == 0.5
    assert set(row_of([0.0] * 8).values()) == {1.0}
    soft = rise({"k_hip_tx": 0.5})
    assert soft - rise({}) == pytest.approx(8.85e-3, rel=0.02)  # m, the leader of the table

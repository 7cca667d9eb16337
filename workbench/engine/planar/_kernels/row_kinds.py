"""The elementary kinds of constraint rows between two bodies; joints are made of them.

Rows up to COINCIDENT_Y are written in the coordinates of the bodies, the others in those of the pair. Their
values and slopes stand in `joint_rows`, their time derivatives in `joint_rates`.
"""

__all__ = ["ANGLE", "COINCIDENT_X", "COINCIDENT_Y", "DISTANCE", "LINE"]

COINCIDENT_X = 0  # p_a + A_a s_a - p_b - A_b s_b along the global x axis
COINCIDENT_Y = 1  # and along y
LINE = 2  # the position of a point of a along a normal fixed to b
ANGLE = 3  # theta_a - theta_b
DISTANCE = 4  # (d.d/L - L)/2 between two points

"""Loops of trees: cut joints as conditions, the nearest start that meets them, what they carry along a run.

`CutJoint` (cuts), `closed` and `nearest` (closing), `cut_force` and `cut_gaps` (histories).
"""

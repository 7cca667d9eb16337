"""Spatial systems as trees in joint coordinates: bodies on joints, forces between them, runs and exact
gradients.

`TreeSystem` (system), joints (joints), runs and gradients (runs), states and bodies' motions (trajectory).
"""

"""Planar systems in absolute coordinates: bodies, joints, members, their runs and trajectories."""

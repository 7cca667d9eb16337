"""Convex subproblems, the min-max master, purification and several objectives."""

"""Sequences of separable approximations and their subproblems."""

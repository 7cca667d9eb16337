"""Designs over a space: kinds, factors, growth, files, the plan of runs."""

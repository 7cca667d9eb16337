"""Solvers for the bound formulation: smallest maximum of several rows under budgets."""

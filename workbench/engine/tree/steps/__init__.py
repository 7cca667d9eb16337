"""The steps that a run of a tree takes where those asked for do not converge, and what is kept of nodes.

`TakenSteps`, `marched` and `closing_of` (halved), `on_grid` (samples).
"""

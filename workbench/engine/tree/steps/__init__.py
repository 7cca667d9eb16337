"""The steps that a run of a tree takes where those asked for do not converge.

`TakenSteps`, `marched` and `closing_of` (halved).
"""

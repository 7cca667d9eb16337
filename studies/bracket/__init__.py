"""A real solver: finite elements in CalculiX give deflection, stress and pitch of a bracket, 15 parameters.

`docs/howto/wire-a-real-solver.md` walks through the study file; `studies/solver_decks.py` compares the lists
of drivers of two designs with the indices of 2 000 runs.
"""

__all__: list[str] = []

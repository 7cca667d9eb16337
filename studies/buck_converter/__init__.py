"""A real solver: ngspice simulates the start-up of a buck converter with sixteen uncertain component values.

`docs/howto/wire-a-real-solver.md` names it; `studies/solver_decks.py` compares the lists of drivers of
two designs of 64 runs with the indices of 2 000 runs.
"""

__all__: list[str] = []

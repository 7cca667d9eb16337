"""A real solver: ngspice gives gain, band and distortion of a transistor amplifier with 20 uncertain values.

`studies/solver_decks.py` compares the lists of drivers of two designs with the indices of 2 000 runs.
"""

__all__: list[str] = []

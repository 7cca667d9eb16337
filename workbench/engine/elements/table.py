"""The table of the member laws.

A member law is a record of parameters and three kernels (`forces`, `energies`, `parameter_slopes`) in a file
of its own, named in `LAWS`. Kernels, tables and public names read that table.
"""

__all__ = ["LAWS", "PARAMETERS", "USER", "code_of"]

# record -> file; the place in the table is the code of the law, and segments of members are sorted by it
LAWS = {"Spring": "spring", "Contact": "contact", "Impulse": "impulse", "Belt": "belt", "Airbag": "airbag"}
USER = 99  # code of laws written in Python, behind all others
PARAMETERS = 9  # most parameters of a law


def code_of(name: str) -> int:
    """The code of a law in the tables of the kernels. Raises ValueError for a name that is no law."""
    return list(LAWS).index(name)

# mypy: ignore-errors
"""Rows of a regression model: each term is the product of the coded columns that it lists."""

from doe._kernel_cache import kernel


@kernel(inner=True)
def expand_row(coded_row, starts, columns, out):
    """out[t] = the product of the entries listed in columns[starts[t]:starts[t + 1]], of one run."""
    for t in range(starts.size - 1):
        value = 1.0
        for q in range(starts[t], starts[t + 1]):
            value *= coded_row[columns[q]]
        out[t] = value


@kernel()
def expand(coded, starts, columns, out):
    """The model rows (n, p) of coded points (n, d)."""
    for r in range(coded.shape[0]):
        expand_row(coded[r], starts, columns, out[r])

"""A row in, an answer out: python, command, fmu, table, and readers of results."""

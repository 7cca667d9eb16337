"""Runs of a search: the ledger, given runs, the unit space they live in."""

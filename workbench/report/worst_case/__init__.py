"""The section of the report on the worst case, with its figures."""

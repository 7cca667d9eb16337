"""The search for the worst case with few true runs."""

"""Which parameters of a study matter, by names and units, and how many runs it takes."""

"""A study walked from design to report, one file per stage, and the campaign as users see it."""

"""The time histories that a campaign keeps: bands over its runs, the worst runs, the first modes."""

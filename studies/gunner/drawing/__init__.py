"""The gunner, his vehicle and the ground to look at."""

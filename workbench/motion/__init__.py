"""Motion to look at: frames, trajectories, stills."""

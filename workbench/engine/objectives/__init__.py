"""What is read off a trajectory: quantities, and their reductions over time."""

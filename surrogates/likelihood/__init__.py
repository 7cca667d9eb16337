"""The restricted likelihood, its correlations, its gradient and the climb to its maximum."""

"""The Kriging estimator: trends, responses, intervals that hold, leave-one-out and a diagnosis."""

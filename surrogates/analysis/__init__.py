"""What a fitted model says of its inputs: main effects, Sobol' indices, and laws to average over."""

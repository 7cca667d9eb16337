"""Latin hypercubes: drawn, spread, grown, sliced and moved by swaps inside their columns."""

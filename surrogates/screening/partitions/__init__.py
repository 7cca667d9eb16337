"""The likelihood of runs in canonical form over partitions of the inputs into groups with one theta each."""

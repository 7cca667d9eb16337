"""The facade over the kinds of systems: simulate, choose steps, judge convergence, locate peaks."""

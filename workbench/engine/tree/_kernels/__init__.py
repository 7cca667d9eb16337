"""Compiled kernels of trees: motion, tangents, elements, branch-sparse factors, time loops."""

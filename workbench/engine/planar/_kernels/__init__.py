"""Compiled kernels of planar systems."""

"""Spatial mechanisms in natural coordinates: points, unit vectors, rigid elements and their runs."""

"""Compiled sweeps of schemes in independent coordinates, forwards and back, for every kind of system."""

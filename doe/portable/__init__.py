"""Draws and linear algebra whose bits are the same on every processor."""

"""Slopes of what a run says of gunner and vehicle by what is uncertain."""

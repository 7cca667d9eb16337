"""Designs that are optimal for a regression model: exchange of rows and coordinates, Latin swaps."""

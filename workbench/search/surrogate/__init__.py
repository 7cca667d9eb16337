"""The Kriging of a search: its form and scale, feasibility, expected improvement."""
